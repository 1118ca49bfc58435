// The order of callbacks, told to ThreadSanitizer: it cannot see how the threads of a library that is not compiled with
// it hand their work over. Without ThreadSanitizer this is nothing.
#pragma once

#ifdef __SANITIZE_THREAD__
extern "C" {
void __tsan_acquire(void* address);
void __tsan_release(void* address);
}
#endif

namespace ballot {

/// While it lives, a thread works on what `job` stands for: it sees the work of those before it, and those after it see
/// its.
class OrderedWork {
 public:
#ifdef __SANITIZE_THREAD__
  explicit OrderedWork(void* job) : job_(job) { __tsan_acquire(job_); }
  ~OrderedWork() { __tsan_release(job_); }
  OrderedWork(const OrderedWork&) = delete;
  OrderedWork& operator=(const OrderedWork&) = delete;

 private:
  void* job_;
#else
  explicit OrderedWork(void*) {}
#endif
};

}  // namespace ballot
