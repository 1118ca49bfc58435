// Tests the number of paths in a wave: within the limits and the memory of the device, and larger if there are many
// paths in all.
#include <gtest/gtest.h>

#include "engine/render/path/wave_room.h"

namespace ballot {
namespace {

constexpr std::uint64_t kGiB = std::uint64_t(1) << 30, kManyPaths = std::uint64_t(1) << 40;

/// Returns the room for waves of a discrete GPU with this much memory, for paths without deferred rays.
WaveRoom gpu_of(std::uint64_t memory) {
  return {.grows = true,
          .memory = memory,
          .path_bytes = 240,
          .most_records = std::uint64_t(1) << 27,
          .most_rays = 1u << 31};
}

TEST(WaveRoom, GrowsWithThePathsThatThereAreInAll) {
  const WaveRoom room = gpu_of(128 * kGiB);
  EXPECT_EQ(wave_capacity(room, 1), 1u << 22);
  EXPECT_EQ(wave_capacity(room, kManyPaths), 1u << 24);
  std::uint32_t before = 0;
  for (std::uint64_t paths = 1; paths < kManyPaths; paths *= 2) {
    const std::uint32_t capacity = wave_capacity(room, paths);
    EXPECT_GE(capacity, before);
    EXPECT_TRUE(capacity <= 1u << 22 || capacity * room.path_bytes <= 8 * paths) << paths;
    before = capacity;
  }
}

TEST(WaveRoom, TakesAnEighthOfTheMemoryUnlessThatIsTooLittle) {
  EXPECT_EQ(wave_capacity(gpu_of(8 * kGiB), kManyPaths), kGiB / 240 / 64 * 64);
  EXPECT_EQ(wave_capacity(gpu_of(2 * kGiB), kManyPaths), 1u << 22);
}

TEST(WaveRoom, KeepsToWhatBuffersAndDispatchesTake) {
  WaveRoom room = gpu_of(128 * kGiB);
  room.most_rays = 65535 * 64;
  EXPECT_EQ(wave_capacity(room, kManyPaths), 65535u * 64);
  room = gpu_of(128 * kGiB);
  room.most_records = (1 << 27) / 32;
  EXPECT_EQ(wave_capacity(room, kManyPaths), 1u << 22);
  room.deferred = 8;
  room.path_bytes += 8 * 64;
  EXPECT_EQ(wave_capacity(room, kManyPaths), 1u << 19);
}

TEST(WaveRoom, HoldsFewerPathsThatPutRaysOff) {
  WaveRoom room = gpu_of(128 * kGiB);
  room.deferred = 8;
  room.path_bytes += 8 * 64;
  EXPECT_EQ(wave_capacity(room, 1), 1u << 20);
  EXPECT_EQ(wave_capacity(room, kManyPaths), 1u << 24);
  room.deferred = 1u << 30;
  EXPECT_EQ(wave_capacity(room, 1), 64u);
}

TEST(WaveRoom, StaysSmallWhereMemoryIsShared) {
  WaveRoom room = gpu_of(128 * kGiB);
  room.grows = false;
  EXPECT_EQ(wave_capacity(room, kManyPaths), 1u << 22);
  room.cpu = true;
  EXPECT_EQ(wave_capacity(room, kManyPaths), 1u << 18);
  room.deferred = 64;
  EXPECT_EQ(wave_capacity(room, kManyPaths), 1u << 17);
}

}  // namespace
}  // namespace ballot
