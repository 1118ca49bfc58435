// How a caller ends long work of the engine: while the work goes on, it asks the caller now and then.
#pragma once

#include <functional>

namespace ballot {

/// While it lives, long work in this thread asks `ask` now and then, which may throw to end the work.
class Interruptible {
 public:
  /// Keeps a reference.
  explicit Interruptible(const std::function<void()>& ask);
  ~Interruptible();
  Interruptible(const Interruptible&) = delete;
  Interruptible& operator=(const Interruptible&) = delete;

 private:
  const std::function<void()>* outer_;
};

/// Returns true if somebody wants to be asked.
bool is_interruptible();

/// Asks, if somebody wants to be asked, at most every 20 ms. Throws what they throw. Cheap enough for every thousandth
/// of a second; not for work that leaves something half done.
void check_interruption();

/// Asks now, if somebody wants to be asked: before the caller waits for others, or for work of any length that nothing
/// ends once it has begun. Throws what they throw.
void ask_interruption();

/// Milliseconds of one launch of such work on a device: nothing ends a launch once it has begun.
constexpr double kInterruptibleLaunch = 100;

}  // namespace ballot
