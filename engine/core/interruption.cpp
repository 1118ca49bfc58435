#include "engine/core/interruption.h"

#include <chrono>
#include <utility>

namespace ballot {

namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kPause = std::chrono::milliseconds(20);

thread_local const std::function<void()>* asked = nullptr;
thread_local Clock::time_point last;

}  // namespace

Interruptible::Interruptible(const std::function<void()>& ask) : outer_(std::exchange(asked, &ask)) {
  last = Clock::now();
}
Interruptible::~Interruptible() { asked = outer_; }

bool is_interruptible() { return asked != nullptr; }

void check_interruption() {
  if (asked && Clock::now() - last >= kPause) ask_interruption();
}

void ask_interruption() {
  if (!asked) return;
  last = Clock::now();
  (*asked)();
}

}  // namespace ballot
