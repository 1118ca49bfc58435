// Traces a file of rays to a file of hits in bounded memory: reading, tracing and writing overlap.
#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "engine/ballot.h"

namespace ballot::cli {

/// Hands blocks from one thread to another, at most `most` at a time. Thread-safe.
template <class T>
class Hand {
 public:
  explicit Hand(std::size_t most) : most_(most) {}

  /// Waits for room. Returns false if the queue is closed: nobody will take the block.
  bool put(T block) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return closed_ || blocks_.size() < most_; });
    if (closed_) return false;
    blocks_.push_back(std::move(block));
    changed_.notify_all();
    return true;
  }
  /// Waits for a block. Returns nothing once the queue is closed and empty.
  std::optional<T> take() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return closed_ || !blocks_.empty(); });
    if (blocks_.empty()) return std::nullopt;
    std::optional<T> block(std::move(blocks_.front()));
    blocks_.pop_front();
    changed_.notify_all();
    return block;
  }
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    changed_.notify_all();
  }

 private:
  std::size_t most_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<T> blocks_;
  bool closed_ = false;
};

/// Reads rays ahead in a thread of its own.
class ReadAhead {
 public:
  /// Takes the file over.
  explicit ReadAhead(RayFile file);
  ~ReadAhead();
  /// Returns the rays that come next, as many as fit. Throws what reading threw.
  std::size_t next(std::span<Ray> room);
  /// Returns the dead rays of the file. Call it behind the last ray.
  const DeadRays& dead() const { return file_.dead(); }

 private:
  void run();

  RayFile file_;
  Hand<std::vector<Ray>> full_, free_;
  std::vector<Ray> block_;
  std::size_t used_ = 0;  // rays of block_
  std::exception_ptr failure_;
  std::jthread thread_;
};

/// Writes bytes behind in a thread of its own.
class WriteBehind {
 public:
  using Write = std::function<void(std::span<const std::byte>)>;
  explicit WriteBehind(Write write);
  ~WriteBehind();
  /// Takes a copy. Throws what writing threw.
  void add(std::span<const std::byte> bytes);
  /// Waits until everything is written. Throws what writing threw.
  void finish();

 private:
  void run();

  Write write_;
  Hand<std::vector<std::byte>> full_, free_;
  std::exception_ptr failure_;
  std::jthread thread_;
};

/// What tracing a file gave.
struct FileTrace {
  std::uint64_t rays = 0, hits = 0;
  TraceTimes times;
  DeadRays dead;
  std::string ray_class;  // of the first rays, if the query's method is auto
};

/// Traces the rays of a file and writes their hits to `to`: an open stream such as /dev/stdout gets them as they come,
/// a file appears when it is complete. The memory does not depend on the number of rays: about 0.4 GiB on the host, as
/// much on a GPU. Throws Error.
FileTrace trace_file(Engine& engine, RayFile from, const std::string& to, const Query& query, const Progress& progress);

}  // namespace ballot::cli
