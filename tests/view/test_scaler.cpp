// Tests of the resolution controller with simulated devices of a given speed.
#include <gtest/gtest.h>

#include "tools/view/scaler.h"

namespace {

using ballot::view::Scaler;

/// Simulates frames on a device that takes `full_ms` for a picture of full resolution and `fixed_ms` besides. Returns
/// the time of the next frame.
double after(Scaler& scaler, double full_ms, double fixed_ms, int frames) {
  for (int i = 0; i < frames; ++i) scaler.measured(full_ms * scaler.scale() * scaler.scale(), fixed_ms);
  return fixed_ms + full_ms * scaler.scale() * scaler.scale();
}

TEST(Scaler, HoldsTheTarget) {
  for (const double full : {20.0, 50.0, 100.0, 400.0}) {
    Scaler scaler(33);
    const double ms = after(scaler, full, 2, 200);
    EXPECT_LT(ms, 33 * 1.15) << full;
    if (full > 33) {
      EXPECT_GT(ms, 33 * 0.6) << full;
    }
  }
}

TEST(Scaler, GoesDownWithinTwoFrames) {
  Scaler scaler(33);
  after(scaler, 100, 0, 2);
  EXPECT_LT(scaler.scale(), 0.65);
}

TEST(Scaler, ReckonsWithWhatThePixelsDoNotChange) {
  Scaler scaler(50);
  const double ms = after(scaler, 400, 15, 1);
  EXPECT_LT(ms, 50) << "one slow frame is enough to react";
  EXPECT_GT(ms, 50 * 0.6);
  const double chosen = scaler.scale();
  after(scaler, 400, 15, 100);
  EXPECT_EQ(scaler.scale(), chosen);
}

TEST(Scaler, StaysWithinItsRange) {
  Scaler slow(8), quick(8);
  after(slow, 1e5, 0, 100);
  EXPECT_EQ(slow.scale(), Scaler::kLeast);
  after(quick, 0.1, 0, 100);
  EXPECT_EQ(quick.scale(), 1);
}

TEST(Scaler, ComesBackWhenTheSceneGetsEasier) {
  Scaler scaler(33);
  after(scaler, 200, 0, 50);
  ASSERT_LT(scaler.scale(), 0.5);
  after(scaler, 10, 0, 200);
  EXPECT_EQ(scaler.scale(), 1);
}

TEST(Scaler, DoesNotFlickerUnderNoise) {
  Scaler scaler(33);
  after(scaler, 80, 0, 100);
  int changes = 0;
  for (int i = 0; i < 300; ++i) {
    const double before = scaler.scale();
    scaler.measured(80 * before * before * (i % 3 == 0 ? 1.12 : 0.95), 0);
    changes += scaler.scale() != before;
  }
  EXPECT_LE(changes, 1);
}

TEST(Scaler, IgnoresWhatIsNoTime) {
  Scaler scaler(33);
  for (const double ms : {0.0, -1.0}) scaler.measured(ms, 0);
  EXPECT_EQ(scaler.scale(), 1);
}

}  // namespace
