// Tests of the builders that run on the CPU: every one makes a sound tree of every shape, within the settings.
#include <gtest/gtest.h>

#include "engine/core/error.h"
#include "engine/tree/host/bvh.h"
#include "tests/cpu/shapes.h"

namespace ballot {

void PrintTo(const Builder& builder, std::ostream* out) { *out << builder.name; }

namespace {

using shapes::Triangles;

class BvhBuilders : public testing::TestWithParam<Builder> {
 protected:
  static Bvh sound(const Triangles& triangles, BuildSettings settings = {}) {
    settings.builder = GetParam().id;
    Bvh bvh = build_bvh(triangles, settings);
    for (const std::string& line : check_bvh(bvh, triangles, settings)) ADD_FAILURE() << line;
    EXPECT_EQ(bvh.stats.builder, GetParam().id);
    EXPECT_EQ(bvh.stats.triangles, triangles.size());
    EXPECT_FALSE(bvh.stats.from_cache);
    return bvh;
  }
};

TEST_P(BvhBuilders, FewTriangles) {
  EXPECT_TRUE(sound({}).nodes.empty());
  for (const std::size_t count : {1u, 2u, 6u, 7u}) {
    sound(shapes::identical(count));
    sound(shapes::soup(count, 1));
  }
}

TEST_P(BvhBuilders, HardShapes) {
  sound(shapes::identical(1000));
  sound(shapes::coplanar(1000));
  sound(shapes::same_centroid(1000));
  sound(shapes::slivers(1000));
  sound(shapes::huge_and_tiny(2000));
  sound(shapes::soup(3000, 0.3f));
  Triangles series;
  for (float x = 1e-12f; x < 1e11f; x *= 1.05f) series.push_back({{{x, 0, 0}, {x, x, 0}, {x, 0, x}}});
  sound(series);
}

TEST_P(BvhBuilders, DegenerateTrianglesAreLeftOut) {
  Triangles triangles = shapes::soup(50, 0.3f);
  triangles[7][1] = triangles[7][0];
  triangles[20] = {{{0, 0, 0}, {1, 1, 1}, {3, 3, 3}}};
  EXPECT_EQ(sound(triangles).stats.degenerate, 2u);
  EXPECT_TRUE(sound(Triangles(9, Triangle{})).nodes.empty());
}

TEST_P(BvhBuilders, LeafLimitHolds) {
  const Triangles triangles = shapes::soup(500, 0.3f);
  for (std::uint32_t most = 1; most <= 6; ++most)
    EXPECT_LE(sound(triangles, {.max_leaf = most}).stats.largest_leaf, most);
}

TEST_P(BvhBuilders, OnlySplittersSplit) {
  const Triangles triangles = shapes::slivers(2000);
  EXPECT_EQ(sound(triangles).stats.references > triangles.size(), GetParam().splits);
}

std::vector<Builder> on_the_cpu() {
  std::vector<Builder> all(std::begin(kBuilders), std::end(kBuilders));
  std::erase_if(all, [](const Builder& b) { return b.on_device || b.chooses; });
  return all;
}

INSTANTIATE_TEST_SUITE_P(Cpu, BvhBuilders, testing::ValuesIn(on_the_cpu()),
                         [](const auto& p) { return std::string(p.param.name); });

// A better builder makes a cheaper tree, and none is far off.
TEST(BvhBuilderOrder, CostsFall) {
  const Triangles triangles = shapes::soup(20000, 0.1f);
  const auto cost = [&](BuilderId id) { return build_bvh(triangles, {.builder = id}).stats.sah; };
  const double best = cost(BuilderId::Best), balanced = cost(BuilderId::Balanced), fast = cost(BuilderId::Fast);
  EXPECT_LE(best, balanced * 1.01);
  EXPECT_LT(balanced, fast);
  EXPECT_LT(fast, 2 * best);
}

TEST(BvhBuilderOrder, AutoTakesTheOneThatIsSoonestDone) {
  constexpr std::size_t kMany = 1'000'000;
  const auto choice = [](BuildSite site) { return choose_builder(BuilderId::Auto, site); };
  EXPECT_EQ(choice({.on_cpu_device = false, .triangles = kMany}), BuilderId::Device);
  EXPECT_EQ(choice({.on_cpu_device = false, .takes_builder = false}), BuilderId::Balanced);
  EXPECT_EQ(choice({.triangles = kMany}), BuilderId::Balanced);
  EXPECT_EQ(choice({.triangles = kMany, .expected_rays = 1e3}), BuilderId::Fast);
  EXPECT_EQ(choice({.triangles = kMany, .expected_rays = 1e9}), BuilderId::Balanced);
  EXPECT_EQ(choose_builder(BuilderId::Best, {.on_cpu_device = false}), BuilderId::Best);
  EXPECT_EQ(build_bvh(shapes::soup(3, 1), {.builder = BuilderId::Auto}).stats.builder, BuilderId::Balanced);
}

TEST(BvhBuilderOrder, ABuilderOfTheDeviceIsRefusedWithoutOne) {
  try {
    build_bvh(shapes::soup(3, 1), {.builder = BuilderId::Device});
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), Failure::Arguments);
    EXPECT_NE(std::string(e.what()).find("runs on a Vulkan device"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace ballot
