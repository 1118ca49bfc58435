#include "engine/core/parallel.h"

#include <unistd.h>

#include <condition_variable>
#include <deque>
#include <system_error>
#include <thread>

namespace ballot {

namespace {

/// Work that threads may join until its caller closes it.
struct Together {
  const std::function<void()>* work;
  std::size_t wanted;       // threads that may still join
  std::size_t running = 0;  // threads that have joined and not returned
};

/// Threads that live as long as the process.
class Pool {
 public:
  Pool() {
    try {
      for (std::size_t i = 1; i < core_count(); ++i) std::thread([this] { serve(); }).detach();
    } catch (const std::system_error&) {
      // The system has no more threads or memory for them, so there are fewer helpers.
    }
  }

  void run(std::size_t helpers, const std::function<void()>& work) {
    Together job{&work, helpers};
    {
      const std::lock_guard lock(mutex_);
      jobs_.push_back(&job);
    }
    if (helpers == 1)
      called_.notify_one();
    else
      called_.notify_all();
    work();
    std::unique_lock lock(mutex_);
    std::erase(jobs_, &job);
    returned_.wait(lock, [&] { return job.running == 0; });
  }

 private:
  void serve() {
    std::unique_lock lock(mutex_);
    while (true) {
      called_.wait(lock, [&] { return !jobs_.empty(); });
      Together& job = *jobs_.front();
      ++job.running;
      if (--job.wanted == 0) jobs_.pop_front();
      lock.unlock();
      (*job.work)();
      lock.lock();
      if (--job.running == 0) returned_.notify_all();
    }
  }

  std::mutex mutex_;
  std::condition_variable called_, returned_;
  std::deque<Together*> jobs_;  // those that more threads may join
};

/// Returns the threads of this process. They are never destroyed, as they run until it ends. A child of fork() has none
/// of its parent's threads, so it gets some of its own.
Pool& pool_of_process() {
  static std::mutex mutex;
  static Pool* pool = nullptr;
  static pid_t owner = 0;
  const std::lock_guard lock(mutex);
  if (!pool || owner != getpid()) {
    owner = getpid();
    pool = new Pool;
  }
  return *pool;
}

}  // namespace

std::size_t core_count() { return std::max(1u, std::thread::hardware_concurrency()); }

void run_together(std::size_t helpers, const std::function<void()>& work) {
  if (helpers == 0)
    work();
  else
    pool_of_process().run(helpers, work);
}

}  // namespace ballot
