// Tests of the size of launches: they end in time, and grow as the device allows.
#include <gtest/gtest.h>

#include "engine/answer/launch_size.h"

namespace ballot {
namespace {

constexpr double kTarget = 50;  // milliseconds

/// Traces `count` rays in launches, each of which takes `per_ray_ms` a ray. Returns the longest one, in milliseconds.
double longest_launch(LaunchSize& size, std::uint64_t count, double per_ray_ms, std::uint64_t& launches) {
  double longest = 0;
  for (launches = 0; count > 0; ++launches) {
    const std::uint64_t rays = std::min(count, size.most(kTarget));
    longest = std::max(longest, double(rays) * per_ray_ms);
    size.add(rays, double(rays) * per_ray_ms);
    count -= rays;
  }
  return longest;
}

TEST(LaunchSizes, EndInTimeAtEverySpeed) {
  for (const double rays_per_ms : {700.0, 1e4, 1e6, 1e8}) {
    LaunchSize size;
    std::uint64_t launches = 0;
    EXPECT_LE(longest_launch(size, 100'000'000, 1 / rays_per_ms, launches), 100) << rays_per_ms;
    EXPECT_LE(double(launches), 5 + 1.5 * 1e8 / rays_per_ms / kTarget) << rays_per_ms;
    longest_launch(size, 1'000'000, 1 / rays_per_ms, launches);  // the speed is known by now
    EXPECT_LE(double(launches), 1 + 1.5 * 1e6 / rays_per_ms / kTarget) << rays_per_ms;
  }
}

TEST(LaunchSizes, FewRaysTellNothing) {
  LaunchSize size;
  size.add(1, 0.02);
  EXPECT_FALSE(size.is_known());
  EXPECT_EQ(size.most(kTarget), LaunchSize::kFirst);
  size.add(100, 10);  // but for very slow ones
  EXPECT_EQ(size.most(kTarget), LaunchSize::kLeast);
}

TEST(LaunchSizes, ForgetASlowFirstLaunch) {
  LaunchSize size;
  size.add(64, 6.5);  // the driver compiled meanwhile
  EXPECT_EQ(size.most(kTarget), LaunchSize::kLeast);
  size.add(1, 0.02);  // of a last launch of a call, which tells less than the first did
  EXPECT_EQ(size.most(kTarget), LaunchSize::kLeast);
  size.add(LaunchSize::kLeast, 0.1);
  EXPECT_EQ(size.most(kTarget), LaunchSize::kFirst);
}

TEST(LaunchSizes, AnUnknownNumberTellsNothing) {
  LaunchSize size;
  size.add(1 << 20, 10);
  const std::uint64_t before = size.most(kTarget);
  size.add(0, 100);
  EXPECT_EQ(size.most(kTarget), before);
}

TEST(LaunchSizes, OfAnyWorkBeginAndMayBecomeSmall) {
  LaunchSize size(64);
  EXPECT_EQ(size.most(kTarget), 64u);
  size.add(64, 0.1);
  EXPECT_EQ(size.most(kTarget), 4096u);
  size.add(4096, 0.1);
  EXPECT_EQ(size.most(kTarget), LaunchSize::kFirst);
  size.add(4096, 100 * kTarget);
  EXPECT_EQ(size.most(kTarget), 64u);
}

TEST(LaunchSizes, StayWholePackets) {
  LaunchSize size;
  size.add(1'000'003, 37);
  EXPECT_EQ(size.most(kTarget) % LaunchSize::kAligned, 0u);
  EXPECT_GT(size.most(kTarget), 1'000'003u);
}

}  // namespace
}  // namespace ballot
