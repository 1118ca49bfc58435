#include "engine/api/state.h"

namespace ballot::api {

namespace {

thread_local bool runs_jobs = false;

}  // namespace

void JobState::end_late() {
  const auto wait = [job = shared_from_this()](void*) {
    if (!runs_jobs) job->wait();
  };
  device_->late.push_back(std::shared_ptr<void>(nullptr, wait));
}

void QueuedJob::end(BallotStatus status, const BallotTimes& times, std::string error) {
  const std::lock_guard lock(mutex_);
  status_ = status;
  times_ = times;
  error_ = std::move(error);
  ended_.notify_all();
}

BallotStatus QueuedJob::wait() {
  std::unique_lock lock(mutex_);
  ended_.wait(lock, [&] { return status_ != BALLOT_NOT_READY; });
  return status_;
}

BallotStatus QueuedJob::poll() {
  const std::lock_guard lock(mutex_);
  return status_;
}

void JobQueue::run(const std::shared_ptr<Shared>& shared) {
  runs_jobs = true;
  while (true) {
    std::function<void()> job;
    {
      std::unique_lock lock(shared->mutex);
      shared->changed.wait(lock, [&] { return shared->closing || !shared->jobs.empty(); });
      if (shared->jobs.empty()) return;
      job = std::move(shared->jobs.front());
      shared->jobs.pop_front();
    }
    job();
  }
}

void JobQueue::add(std::function<void()> job) {
  const std::lock_guard lock(mutex_);
  if (!shared_) {
    shared_ = std::make_shared<Shared>();
    std::thread([shared = shared_] { run(shared); }).detach();
  }
  const std::lock_guard inner(shared_->mutex);
  shared_->jobs.push_back(std::move(job));
  shared_->changed.notify_one();
}

JobQueue::~JobQueue() {
  if (!shared_) return;
  const std::lock_guard lock(shared_->mutex);
  shared_->closing = true;
  shared_->changed.notify_one();
}

}  // namespace ballot::api
