// Tests how pixels and samples are divided into dispatches: each is traced once, the samples of a pixel come in order,
// and no dispatch has more rays than there is room for.
#include <gtest/gtest.h>

#include <vector>

#include "engine/render/data/parts.h"

namespace ballot {
namespace {

void expect_covered(std::uint32_t pixels, std::uint32_t samples, std::uint32_t most_rays, std::uint32_t together) {
  SCOPED_TRACE(testing::Message() << pixels << " pixels, " << samples << " samples, " << most_rays << " rays");
  const Part largest = largest_part(pixels, samples, most_rays, together);
  std::vector<std::uint32_t> has(pixels, 0);
  for_parts(pixels, samples, largest, [&](const Part& part) {
    ASSERT_GT(part.rays(), 0u);
    ASSERT_LE(part.rays(), std::min(most_rays, largest.rays()));
    ASSERT_LE(part.pixel + part.pixels, pixels);
    for (std::uint32_t i = part.pixel; i < part.pixel + part.pixels; ++i) {
      ASSERT_EQ(has[i], part.sample);
      has[i] += part.samples;
    }
  });
  for (const std::uint32_t n : has) ASSERT_EQ(n, samples);
}

TEST(Parts, EverySampleOfEveryPixelOnceAndInOrder) {
  for (const std::uint32_t pixels : {0u, 1u, 2u, 7u, 64u, 1000u})
    for (const std::uint32_t samples : {0u, 1u, 2u, 15u, 16u, 17u, 47u, 256u, 1000u})
      for (const std::uint32_t most : {1u, 2u, 13u, 64u, 1000u, 4096u, 1u << 22})
        for (const std::uint32_t together : {1u, 4u, 16u}) expect_covered(pixels, samples, most, together);
}

TEST(Parts, OnePixelsSamplesGoTogetherInEvenTurns) {
  const auto expect = [](std::uint32_t pixels, std::uint32_t samples, std::uint32_t pixels_at_once,
                         std::uint32_t samples_at_once) {
    const Part part = largest_part(pixels, samples, 1 << 22, 16);
    EXPECT_EQ(part.pixels, pixels_at_once);
    EXPECT_EQ(part.samples, samples_at_once);
  };
  expect(1 << 20, 1, 1 << 20, 1);
  expect(1 << 20, 64, 1 << 18, 16);
  expect(1 << 20, 20, (1 << 22) / 10, 10);  // not 16 and then 4
  expect(64 * 64, 256, 64 * 64, 256);       // a small picture fills the device too
}

}  // namespace
}  // namespace ballot
