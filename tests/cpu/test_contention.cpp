// Tests that a thread notices how busy the cores are with other work.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <thread>
#include <vector>

#include "engine/core/contention.h"
#include "engine/core/parallel.h"

namespace ballot {
namespace {

void compute(double seconds) {
  const auto start = std::chrono::steady_clock::now();
  while (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() < seconds)
    std::atomic_signal_fence(std::memory_order_seq_cst);
}

TEST(Contention, AThreadAmongManyWaitsForItsCore) {
  std::vector<std::jthread> others;
  for (std::size_t i = 0; i < 3 * core_count(); ++i)
    others.emplace_back([](const std::stop_token& stop) {
      while (!stop.stop_requested()) std::atomic_signal_fence(std::memory_order_seq_cst);
    });
  double busy = 0;
  std::thread([&] {
    compute(0.3);  // a fourth of it on a core, or less
    busy = contention();
  }).join();
  others.clear();
  double run = 0;  // stays 0 where the system does not tell
  std::ifstream("/proc/thread-self/schedstat") >> run;
  if (run > 0)
    EXPECT_GT(busy, 1.5);
  else
    EXPECT_EQ(busy, 1);
}

TEST(Contention, AThreadThatDidLittleGivesTheSameAnswer) {
  std::thread([] {
    EXPECT_EQ(contention(), 1);
    compute(0.1);
    const double before = contention();
    EXPECT_GE(before, 1);
    EXPECT_EQ(contention(), before);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));  // sleep is no work
    EXPECT_EQ(contention(), before);
  }).join();
}

}  // namespace
}  // namespace ballot
