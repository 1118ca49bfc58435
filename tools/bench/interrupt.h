// A guard that turns SIGINT and SIGTERM into a request to stop while it is alive.
#pragma once

#include <csignal>

namespace ballot::bench {

/// Records the first signal; a second one ends the program as usual. The destructor restores the old handlers. Only one
/// guard may be alive at a time.
class InterruptGuard {
 public:
  InterruptGuard() {
    wanted_ = 0;
    old_int_ = std::signal(SIGINT, note);
    old_term_ = std::signal(SIGTERM, note);
  }
  ~InterruptGuard() {
    std::signal(SIGINT, old_int_);
    std::signal(SIGTERM, old_term_);
  }
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  bool wanted() const { return wanted_ != 0; }

 private:
  static void note(int signal) {
    wanted_ = 1;
    std::signal(signal, SIG_DFL);
  }

  using Handler = void (*)(int);
  Handler old_int_, old_term_;
  static inline volatile std::sig_atomic_t wanted_ = 0;
};

}  // namespace ballot::bench
