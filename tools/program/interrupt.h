// A guard that turns SIGINT, SIGTERM and SIGHUP into a request to stop while it is alive.
#pragma once

#include <csignal>
#include <string>
#include <utility>

#include "engine/scene/device_scene.h"

namespace ballot {

/// Thrown where work stops because a signal asked for it. The exit code is 128 + signal: 130 of SIGINT, 143 of SIGTERM.
class Stopped : public Error {
 public:
  /// `text` says what was kept and how to go on.
  Stopped(int signal, const std::string& text) : Error(Failure::Work, text), signal_(signal) {}
  int exit_code() const { return 128 + signal_; }

 private:
  int signal_;
};

/// Records the first signal; a second one ends the program as usual. A signal that was ignored before stays ignored, as
/// nohup wants it. The destructor restores the old handlers. Only one guard may be alive at a time.
class InterruptGuard {
 public:
  InterruptGuard() {
    signal_ = 0;
    for (auto& [signal, old] : old_) {
      old = std::signal(signal, note);
      if (old == SIG_IGN) std::signal(signal, SIG_IGN);
    }
  }
  ~InterruptGuard() {
    for (const auto& [signal, old] : old_) std::signal(signal, old);
  }
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  /// Returns the signal that asked to stop; 0: none.
  int signal() const { return signal_; }
  bool wanted() const { return signal_ != 0; }
  /// Returns the name of that signal.
  const char* name() const { return signal_ == SIGINT ? "SIGINT" : signal_ == SIGTERM ? "SIGTERM" : "SIGHUP"; }
  /// Throws Stopped if a signal asked to stop, for work of which nothing is kept.
  void stop(const char* work) const {
    if (wanted()) throw Stopped(signal_, fmt::format("{} was stopped by {}; nothing was written", work, name()));
  }

 private:
  static void note(int signal) {
    signal_ = signal;
    std::signal(signal, SIG_DFL);
  }

  using Handler = void (*)(int);
  std::pair<int, Handler> old_[3] = {{SIGINT, SIG_DFL}, {SIGTERM, SIG_DFL}, {SIGHUP, SIG_DFL}};
  static inline volatile std::sig_atomic_t signal_ = 0;
};

}  // namespace ballot
