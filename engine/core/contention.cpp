#include "engine/core/contention.h"

#include <algorithm>
#include <cstdint>
#include <fstream>

#include "engine/core/parallel.h"

namespace ballot {

namespace {

constexpr std::uint64_t kLeastRun = 10'000'000;  // ns

/// Nanoseconds that a thread has run, and that it has waited for a core.
struct Spent {
  std::uint64_t run = 0, waited = 0;
};

Spent spent_by_this_thread() {
  Spent spent;
  std::ifstream file("/proc/thread-self/schedstat");
  if (!(file >> spent.run >> spent.waited)) return {};
  return spent;
}

}  // namespace

double contention() {
  thread_local Spent before;
  thread_local double answer = 1;
  const Spent now = spent_by_this_thread();
  const std::uint64_t run = now.run - std::min(now.run, before.run);
  if (run < kLeastRun) return answer;
  const double met = 1 + double(now.waited - std::min(now.waited, before.waited)) / double(run);
  answer = std::max(1.0, met - 0.5 / double(core_count()));
  before = now;
  return answer;
}

}  // namespace ballot
