// Tests of the choice between a refit and a build, on a clock that the tests set.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "engine/tree/host/refit_policy.h"

namespace ballot {
namespace {

/// A scene that moves: what a build and a refit take, and a frame with a tree that was just built, in seconds. A refit
/// raises the cost of the tree by `growth` of that at its build.
struct Moving {
  double build, refit, frame, growth;
};

/// Runs `frames` updates, each with a trace after it, as the policy says. Returns the seconds in all.
double run(const Moving& m, int frames, int* builds = nullptr) {
  RefitPolicy policy;
  policy.built(m.build, 100);
  double seconds = 0, decay = 1;
  for (int f = 0; f < frames; ++f) {
    bool build = policy.wants_build();
    if (!build) {
      decay += m.growth;
      seconds += m.refit;
      policy.refitted(m.refit, 100 * decay);
      build = policy.regrets_refit();
    }
    if (build) {
      seconds += m.build;
      decay = 1;
      policy.built(m.build, 100);
      if (builds) ++*builds;
    }
    seconds += m.frame * decay;
    policy.traced(m.frame * decay);
  }
  return seconds;
}

/// Returns the seconds of the best fixed number of refits between two builds.
double best_in_hindsight(const Moving& m, int frames) {
  double best = std::numeric_limits<double>::infinity();
  for (int every = 1; every <= frames + 1; ++every) {
    double seconds = 0, decay = 1;
    for (int f = 0; f < frames; ++f) {
      const bool build = f % every == every - 1;
      decay = build ? 1 : decay + m.growth;
      seconds += (build ? m.build : m.refit) + m.frame * decay;
    }
    best = std::min(best, seconds);
  }
  return best;
}

TEST(RefitPolicy, NeverCostsTwiceTheBestInHindsight) {
  constexpr int kFrames = 300;
  for (const double build : {0.01, 1.0, 100.0})
    for (const double refit : {0.0001, 0.01, 0.9})
      for (const double frame : {0.0, 0.001, 0.1, 10.0})
        for (const double growth : {0.0, 0.001, 0.1, 3.0}) {
          const Moving m{build, refit * build, frame, growth};
          EXPECT_LE(run(m, kFrames), 2 * best_in_hindsight(m, kFrames) + build)
              << build << " " << refit << " " << frame << " " << growth;
        }
}

TEST(RefitPolicy, ATreeThatDoesNotDecayIsNeverBuilt) {
  int builds = 0;
  run({1, 0.01, 5, 0}, 1000, &builds);
  EXPECT_EQ(builds, 0);
  RefitPolicy better;  // a move may make a tree cheaper
  better.built(1, 100);
  better.refitted(0.1, 60);
  better.traced(1e6);
  EXPECT_FALSE(better.wants_build());
  EXPECT_FALSE(better.regrets_refit());
}

TEST(RefitPolicy, WithoutTracesATreeIsNeverBuilt) {
  int builds = 0;
  run({1, 0.01, 0, 10}, 1000, &builds);
  EXPECT_EQ(builds, 0);
}

TEST(RefitPolicy, BuildsOnceTracesHaveLostWhatABuildTakes) {
  RefitPolicy policy;
  policy.built(1.0, 50);
  policy.refitted(0.25, 100);
  EXPECT_EQ(policy.decay(), 2);
  policy.traced(1.4);  // half of it is lost
  EXPECT_FALSE(policy.wants_build());
  policy.traced(0.2);
  EXPECT_TRUE(policy.wants_build());
  policy.built(1.0, 50);
  EXPECT_FALSE(policy.wants_build());
  EXPECT_EQ(policy.decay(), 1);
  EXPECT_EQ(policy.build_s(), 1.0);
  EXPECT_EQ(policy.refit_s(), 0.25);
}

TEST(RefitPolicy, BuildsAtOnceWhereTheNextTracesWouldLoseMore) {
  RefitPolicy policy;
  policy.built(1.0, 50);
  policy.traced(0.5);
  policy.refitted(0.01, 100);
  EXPECT_FALSE(policy.regrets_refit());
  policy.traced(1.0);  // half a second with a sound tree
  policy.refitted(0.01, 500);
  EXPECT_TRUE(policy.regrets_refit());
}

// Queries may go on without another move. Then the tree is to be built between them, once they have lost a build.
TEST(RefitPolicy, IsOverdueOnceQueriesHaveLostABuild) {
  RefitPolicy policy;
  policy.built(1.0, 50);
  policy.traced(100);  // by a sound tree
  EXPECT_FALSE(policy.overdue());
  policy.refitted(0.25, 500);
  policy.traced(1.0);  // of which 0.9 are lost
  EXPECT_FALSE(policy.overdue());
  policy.traced(0.2);
  EXPECT_TRUE(policy.overdue());
  policy.built(1.0, 50);
  EXPECT_FALSE(policy.overdue());
}

// The cost of a tree may leave every range. A build that is no slower than a refit is always taken.
TEST(RefitPolicy, Extremes) {
  RefitPolicy policy;
  policy.built(1, 50);
  policy.refitted(0.1, std::numeric_limits<double>::infinity());
  EXPECT_TRUE(policy.regrets_refit());
  policy.built(1, 50);
  policy.refitted(0.1, std::numeric_limits<double>::quiet_NaN());
  EXPECT_TRUE(policy.regrets_refit());
  policy.built(1, 0);  // an empty tree
  policy.refitted(0.1, 0);
  EXPECT_EQ(policy.decay(), 1);
  EXPECT_FALSE(policy.regrets_refit());
  policy.built(1, 50);
  policy.refitted(2, 50);
  EXPECT_TRUE(policy.wants_build());
}

}  // namespace
}  // namespace ballot
