// Work in the background: a thread for each device that runs its jobs in turn.
#pragma once

#include <unistd.h>

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "engine/api/ballot_c.h"

namespace ballot::api {

struct DeviceState;

/// A job and, once it has ended, what came of it. Thread-safe.
class JobState : public std::enable_shared_from_this<JobState> {
 public:
  explicit JobState(std::shared_ptr<DeviceState> device) : device_(std::move(device)) {}
  virtual ~JobState() = default;
  /// Waits for the end.
  virtual BallotStatus wait() = 0;
  /// Returns BALLOT_NOT_READY before the end.
  virtual BallotStatus poll() = 0;
  /// Returns false in a child of the process that submitted the job, where its thread does not exist.
  bool is_ours() const { return owner_ == getpid(); }
  pid_t owner() const { return owner_; }
  const DeviceState& device() const { return *device_; }
  /// Has the call that holds the device wait for the job once it has let go of it. In a callback of another job it does
  /// not: the thread of jobs would wait for itself.
  void end_late();
  /// After the end.
  const BallotTimes& times() const { return times_; }
  const std::string& error() const { return error_; }

 protected:
  BallotTimes times_{};
  std::string error_;

 private:
  const pid_t owner_ = getpid();
  const std::shared_ptr<DeviceState> device_;
};

/// A job of a JobQueue.
class QueuedJob : public JobState {
 public:
  using JobState::JobState;
  void end(BallotStatus status, const BallotTimes& times, std::string error);
  BallotStatus wait() override;
  BallotStatus poll() override;

 private:
  std::mutex mutex_;
  std::condition_variable ended_;
  BallotStatus status_ = BALLOT_NOT_READY;
};

/// Runs jobs one after another in a thread of its own, which begins with the first job. The destructor lets the thread
/// end once all jobs are done, without waiting for it: the last job may be what destroys the queue.
class JobQueue {
 public:
  JobQueue() = default;
  ~JobQueue();
  JobQueue(const JobQueue&) = delete;
  JobQueue& operator=(const JobQueue&) = delete;

  void add(std::function<void()> job);

 private:
  struct Shared {
    std::mutex mutex;
    std::condition_variable changed;
    std::deque<std::function<void()>> jobs;
    bool closing = false;
  };
  static void run(const std::shared_ptr<Shared>& shared);

  std::mutex mutex_;
  std::shared_ptr<Shared> shared_;  // null before the first job
};

}  // namespace ballot::api
