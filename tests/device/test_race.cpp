// Tests of the race of method auto, on simulated devices with a clock of their own.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <stdexcept>

#include "engine/trace/auto/race.h"

namespace ballot {
namespace {

constexpr std::size_t kLook = 1 << 12, kSample = 1 << 15;

struct SimulatedKernel {
  double compile_s, mrays_per_s;
  bool runs = true;
  double beside_s = 0;  // of compile_s: what a second core can do while the rays before the race are traced
  double varies = 0;    // by what share a round takes longer than the fastest, at most
};

/// A device that compiles and traces in simulated time. Other processes make each step up to `busy` times as long, and
/// at least `least` times.
class Simulated {
 public:
  Simulated(std::vector<SimulatedKernel> kernels, double busy, double least = 1)
      : kernels_(std::move(kernels)), slow_(least, busy) {
    runners.resize(kernels_.size());
  }

  /// Runs a process that traces `rays` rays, and returns the seconds that its race took.
  double process(double rays, int runs_left) {
    const double first_s =
        after ? slow_(random_) * (1.5 * kernels_[0].compile_s + double(kSample) / kernels_[0].mrays_per_s * 1e-6) : 0;
    const double start = now_;
    const auto untried = std::size_t(std::ranges::count(runners, false, &Runner::tried));
    const RaceRules rules{.first_s = runners[0].tried ? 0 : first_s,
                          .first_rays = kSample,
                          .all_rays = rays,
                          .contention = after ? slow_(random_) : 1,
                          .must = (untried + std::size_t(runs_left) - 1) / std::size_t(runs_left),
                          .last = runs_left == 1,
                          .samples = 3,
                          .look_rays = kLook,
                          .most_rays = kSample,
                          .rounds = 9,
                          .statistic = statistic};
    for (Runner& r : runners) r.look_ms = 0, r.ms.clear(), r.prepared = false;
    const std::size_t begun = after ? next_to_prepare(runners, rules) : 0;
    if (begun > 0) runners[begun].prepared = true;
    std::vector<bool> compiled(kernels_.size(), false);
    longest_ = 0;
    std::vector<double> ready(kernels_.size(), -1);  // when a compilation that was begun beside ends
    const RaceHost host{
        .now = [&] { return now_; },
        .compile =
            [&](std::size_t i) {
              compiled[i] = true;
              wait(ready[i] < 0 ? compile_s(i, begun) : std::max(0.0, ready[i] - now_));
              return kernels_[i].runs;
            },
        .trace =
            [&](std::size_t i, std::size_t, std::size_t some) {
              EXPECT_TRUE(compiled[i] && kernels_[i].runs && some <= kSample);
              EXPECT_LE(std::ranges::max(ready), now_) << "disturbed by what is compiled beside it";
              traced[i] += some;
              const double longer = std::uniform_real_distribution<double>(1, 1 + kernels_[i].varies)(random_);
              return wait(longer * double(some) / kernels_[i].mrays_per_s * 1e-6) * 1e3;
            },
        .prepare =
            [&](std::size_t i) {
              EXPECT_FALSE(compiled[i]);
              if (beside) ready[i] = now_ + kernels_[i].compile_s;
            },
        .settle = [&](double seconds) { now_ = std::max(now_, std::min(now_ + seconds, std::ranges::max(ready))); },
        .keep =
            [&] {
              ++kept;
              if (kept == ends_at) throw std::runtime_error("interrupted");
            }};
    race(runners, rules, host);
    for (std::size_t i = 0; i < ready.size(); ++i) {
      EXPECT_TRUE(compiled[i] || ready[i] < 0) << "compiled for nothing";
      // What was begun beside the rays before the race must enter, unless busy cores leave no time for it.
      EXPECT_TRUE(compiled[i] || begun == 0 || i != begun || slow_.max() > 1.05) << "compiled for nothing";
    }
    remember();
    return now_ - start;
  }

  /// Puts the fastest first, as the list of a choice has it.
  void remember() {
    const std::vector<double> slowness = slowness_of(runners, 3, statistic);
    for (std::size_t i = 0; i < runners.size(); ++i) runners[i].slower = slowness[i] < 1e9 ? slowness[i] : 0;
    const auto first = std::ptrdiff_t(std::ranges::min_element(slowness) - slowness.begin());
    std::rotate(runners.begin(), runners.begin() + first, runners.begin() + first + 1);
    std::rotate(kernels_.begin(), kernels_.begin() + first, kernels_.begin() + first + 1);
    std::rotate(traced.begin(), traced.begin() + first, traced.begin() + first + 1);
  }

  /// Returns how many times as slow as the best kernel the chosen one is.
  double regret() const {
    double best = 0;
    for (const SimulatedKernel& k : kernels_)
      if (k.runs) best = std::max(best, k.mrays_per_s);
    return best / kernels_[0].mrays_per_s;
  }
  void slow_down(double least, double busy) { slow_ = std::uniform_real_distribution<double>(least, busy); }
  bool all_tried() const { return std::ranges::all_of(runners, &Runner::tried); }
  /// Returns true if no runner is left for a later process.
  bool settled() const {
    return std::ranges::all_of(runners, [](const Runner& r) { return r.tried || r.put_off_s > 0; });
  }
  /// Returns the longest step of the last process.
  double longest() const { return longest_; }

  std::vector<Runner> runners;
  std::vector<std::size_t> traced = std::vector<std::size_t>(16);
  int kept = 0, ends_at = -1;
  Statistic statistic = Statistic::Least;
  bool beside = false;  // a second core compiles what the race prepares
  bool after = false;   // rays were traced before the race, by the first kernel

 private:
  double compile_s(std::size_t i, std::size_t begun) const {
    if (after && i == 0) return 0;
    return kernels_[i].compile_s - (begun > 0 && i == begun ? kernels_[i].beside_s : 0);
  }
  double wait(double seconds) {
    const double taken = seconds * slow_(random_);
    now_ += taken;
    longest_ = std::max(longest_, taken);
    return taken;
  }
  std::vector<SimulatedKernel> kernels_;
  std::mt19937 random_{7};
  std::uniform_real_distribution<double> slow_;
  double now_ = 100, longest_ = 0;
};

// Measured on lavapipe 22.3.6: seconds to compile, and the speeds of incoherent rays.
const std::vector<SimulatedKernel> kLavapipe{{0.17, 1.6}, {0.26, 2.2}, {0.69, 0.9}, {0.27, 1.7}};

TEST(AutoRace, ThreeProcessesTryAllAndFindTheFastest) {
  Simulated device(kLavapipe, 1.1);
  for (int left = 3; left > 0; --left) {
    EXPECT_FALSE(device.all_tried());
    // What has to be compiled, and beside it the budget and the rounds of each process.
    EXPECT_LE(device.process(1 << 18, left), 0.3 + 0.69 * 1.1 + 0.3 * 0.3 + 0.1) << left;
  }
  EXPECT_TRUE(device.all_tried());
  EXPECT_LE(device.regret(), 1.05);
}

// Measured on lavapipe 22.3.6 on quiet cores: seconds to compile, and the speeds of primary rays.
const SimulatedKernel kPlainest{0.10, 5.1}, kTurns{0.12, 9, true, 0.04}, kPair{0.14, 12, true, 0.06},
    kPackets{0.34, 15, true, 0.11}, kFetch{0.11, 5};
const std::vector<SimulatedKernel> kCoherent{kPlainest, kPair, kTurns, kFetch, kPackets},
    kIncoherent{kPlainest, kTurns, kPair, kFetch, kPackets};

Simulated after_rays(const std::vector<SimulatedKernel>& kernels, double busy, double least = 1) {
  Simulated device(kernels, busy, least);
  device.after = true;
  for (std::size_t i = 0; i < kernels.size(); ++i) device.runners[i].entry_s = kernels[i].compile_s;
  return device;
}

TEST(AutoRace, ThreeQuietProcessesStayWithinTheBudget) {
  for (const auto& kernels : {kCoherent, kIncoherent})
    for (std::size_t best = 0; best < kernels.size(); ++best) {
      std::vector<SimulatedKernel> some = kernels;
      some[best].mrays_per_s = 20;
      Simulated device = after_rays(some, 1.05);
      for (int left = 3; left > 0; --left) EXPECT_LE(device.process(1 << 16, left), 0.3) << left;
      EXPECT_EQ(std::ranges::count(device.runners, true, &Runner::tried), 4);
      EXPECT_TRUE(device.settled());  // kPackets is put off
      if (some[best].compile_s < kPackets.compile_s) {
        EXPECT_EQ(device.regret(), 1) << best;
      }
      EXPECT_LE(device.process(3e8, 1), 0.05 * 3e8 / 20e6);  // it is tried where that costs little
      EXPECT_TRUE(device.all_tried());
      EXPECT_EQ(device.regret(), 1) << best;
    }
}

TEST(AutoRace, ASlowProcessPutsOffWhatCostsMoreThanItGains) {
  for (const double slow : {1.5, 2.5, 4.0}) {
    Simulated device = after_rays(kIncoherent, 1.05 * slow, slow);
    for (int left = 3; left > 0; --left) EXPECT_LE(device.process(1 << 16, left), 0.3);
    EXPECT_FALSE(device.all_tried());
    EXPECT_TRUE(device.settled());
    const auto packets = std::ranges::find(device.runners, kPackets.compile_s, &Runner::entry_s);
    ASSERT_NE(packets, device.runners.end());
    EXPECT_FALSE(packets->tried);
    EXPECT_GT(packets->put_off_s, 0.3);
    EXPECT_LE(packets->put_off_s, 1.06 * slow * packets->entry_s);
    // A long batch pays for it.
    const double rays = 3e8, batch_s = rays / 9e6 * slow;
    EXPECT_LE(device.process(rays, 1), 0.05 * batch_s + device.longest());
    EXPECT_TRUE(device.all_tried());
    EXPECT_EQ(device.regret(), 1);
  }
}

TEST(AutoRace, WhatASecondCoreCompilesIsNoSignOfAFastOne) {
  Simulated device = after_rays(kIncoherent, 1);
  device.beside = true;
  for (int left = 3; left > 0; --left) device.process(1 << 16, left);
  EXPECT_TRUE(device.settled());
  const auto packets = std::ranges::find(device.runners, kPackets.compile_s, &Runner::entry_s);
  EXPECT_FALSE(packets->tried);
  EXPECT_EQ(packets->put_off_s, kPackets.compile_s);
}

TEST(AutoRace, OneRunnerEntersHoweverLongItTakes) {
  Simulated device = after_rays({{0.34, 5}, {0.34, 15}}, 1);
  device.process(1 << 16, 3);
  EXPECT_TRUE(device.runners[0].tried);
  EXPECT_GT(device.runners[1].put_off_s, 0.3);
  Simulated failing = after_rays({{0.34, 5, false}, {0.34, 15}}, 1);
  failing.process(1 << 16, 3);
  EXPECT_TRUE(failing.all_tried());
  EXPECT_EQ(failing.regret(), 1);
}

TEST(AutoRace, WhatIsExpectedToTakeTooLongIsLeftToTheNextProcess) {
  Simulated device = after_rays({kPlainest, kTurns, kPackets, kFetch}, 1);
  EXPECT_LE(device.process(1 << 16, 3), 0.3);
  std::vector<bool> tried;
  for (const Runner& r : device.runners) tried.push_back(r.tried);
  EXPECT_EQ(std::ranges::count(tried, true), 3);  // all but the one that compiles slowly, which is not the last
  EXPECT_FALSE(tried[2]);
}

// Entering can't be interrupted, so that on busy cores nothing enters that would end too late.
TEST(AutoRace, BusyProcessesStayWithinTheBudget) {
  for (const double slow : {1.3, 1.6, 2.0, 3.0, 5.0}) {
    Simulated device = after_rays(kCoherent, 1.1 * slow, 0.9 * slow);
    for (int left = 3; left > 0; --left) EXPECT_LE(device.process(1 << 16, left), 0.3) << slow;
    EXPECT_TRUE(device.settled()) << slow;
    EXPECT_LE(device.process(3e8, 1), 0.05 * 3e8 / 12e6 * 1.1 * slow) << slow;  // a long batch pays for all
    EXPECT_TRUE(device.all_tried()) << slow;
    EXPECT_EQ(device.regret(), 1) << slow;
  }
}

TEST(AutoRace, WhatABusyProcessLeavesAQuietOneTries) {
  Simulated device = after_rays(kCoherent, 3, 2.8);
  device.process(1 << 16, 3);
  EXPECT_EQ(std::ranges::count(device.runners, true, &Runner::tried), 1);
  EXPECT_EQ(std::ranges::count_if(device.runners, [](const Runner& r) { return r.put_off_s > 0; }), 1);  // kPackets
  device.slow_down(1, 1);
  for (int left = 2; left > 0; --left) EXPECT_LE(device.process(1 << 16, left), 0.3);
  EXPECT_EQ(std::ranges::count(device.runners, true, &Runner::tried), 4);  // all but kPackets
  EXPECT_EQ(device.regret(), 15.0 / 12);
}

TEST(AutoRace, TheNextCompilesWhileTheFirstIsTried) {
  double alone = 0, beside = 0;
  for (const bool two_cores : {false, true}) {
    Simulated device(kLavapipe, 1);
    device.beside = two_cores;
    (two_cores ? beside : alone) = device.process(1 << 18, 3);
    EXPECT_LE(device.regret(), 1.05);
  }
  EXPECT_LE(beside, alone - 0.16);  // the first takes 0.17 s to compile, the second 0.26 s
}

TEST(AutoRace, AQuietSecondProcessCostsLittle) {
  Simulated device(kLavapipe, 1);
  device.process(1 << 18, 3);
  EXPECT_LE(device.regret(), 1.05);  // the likely ones come first
  EXPECT_LE(device.process(1 << 18, 2), 0.3 + 0.69 + 0.26);
}

TEST(AutoRace, NothingIsBegunThatWouldEndTooLate) {
  Simulated device({{0.1, 2}, {0.14, 2}, {0.43, 2}, {0.1, 2}}, 1);  // lavapipe, idle
  EXPECT_LE(device.process(1 << 18, 3), 0.3 + 0.1);
  EXPECT_FALSE(device.runners[2].tried);
}

TEST(AutoRace, ALongBatchPaysForAllTrials) {
  Simulated device(kLavapipe, 1);
  const double batch_s = 1e8 / 2.2e6;
  EXPECT_LE(device.process(1e8, 3), 0.05 * batch_s + device.longest());
  EXPECT_TRUE(device.all_tried());
  EXPECT_EQ(device.regret(), 1);
}

TEST(AutoRace, AGpuKernelIsJudgedByItsMiddleRound) {
  Simulated device({{0.01, 4000}, {0.01, 4400, true, 0, 0.3}}, 1);  // the second mostly takes longer than the first
  device.statistic = Statistic::Median;
  device.process(1 << 20, 1);
  EXPECT_DOUBLE_EQ(device.regret(), 1.1) << "the first is chosen, although the best round is the second's";
  EXPECT_EQ(device.runners[1].ms.size(), 9u);
}

TEST(AutoRace, HopelessCandidatesAreDroppedAtTheirFirstLook) {
  Simulated device({{0.01, 2}, {0.01, 0.02}, {0.01, 1.9}, {0.01, 0.9}}, 1);
  const double spent = device.process(1e7, 1);
  EXPECT_EQ(device.traced[1], 2 * kLook);  // it is looked at again, as it may have been disturbed
  EXPECT_EQ(device.traced[3], 2 * kLook);
  EXPECT_GT(device.traced[2], 3 * kLook);
  EXPECT_LE(spent, 0.05 + 2 * kLook / 0.02e6 + 0.4);
  EXPECT_EQ(device.regret(), 1);
}

TEST(AutoRace, SlowScenesGetFewRays) {
  Simulated device({{0.17, 0.02}, {0.26, 0.018}, {0.69, 0.015}, {0.27, 0.02}}, 4);  // 100 000 random triangles, busy
  for (int left = 3; left > 0; --left) EXPECT_LE(device.process(1 << 18, left), 6.5) << left;
  for (const std::size_t rays : device.traced) EXPECT_LE(rays, 12 * kLook);
  EXPECT_TRUE(device.all_tried());
}

TEST(AutoRace, BusyDevicesChooseWellEnough) {
  double sum = 0;
  for (int repeat = 0; repeat < 20; ++repeat) {
    std::vector<SimulatedKernel> kernels = kLavapipe;
    std::rotate(kernels.begin(), kernels.begin() + repeat % 4, kernels.end());
    Simulated device(kernels, 3);
    for (int left = 3; left > 0; --left) device.process(1 << 20, left);
    EXPECT_TRUE(device.all_tried());
    EXPECT_LE(device.regret(), 1.6);
    sum += device.regret();
  }
  EXPECT_LE(sum / 20, 1.2);
}

TEST(AutoRace, WhatWasTriedIsKeptWhenInterrupted) {
  Simulated device(kLavapipe, 1);
  device.ends_at = 2;
  EXPECT_THROW(device.process(1 << 18, 3), std::runtime_error);
  EXPECT_TRUE(device.runners[0].tried && device.runners[1].tried);
  EXPECT_FALSE(device.runners[2].tried);
  device.remember();
  device.ends_at = -1;
  device.process(1 << 18, 2);
  device.process(1 << 18, 1);
  EXPECT_TRUE(device.all_tried());
}

TEST(AutoRace, CandidatesThatCannotRun) {
  Simulated device({{0.1, 1, false}, {0.1, 2}, {0.1, 3, false}}, 1);
  for (int left = 3; left > 0; --left) device.process(1 << 18, left);
  EXPECT_TRUE(device.all_tried());
  EXPECT_GT(device.runners[0].look_ms, 0);
  Simulated none({{0.1, 1, false}, {0.1, 1, false}}, 1);
  none.process(1 << 18, 1);
  EXPECT_TRUE(none.all_tried());
  EXPECT_EQ(none.kept, 0);
}

}  // namespace
}  // namespace ballot
