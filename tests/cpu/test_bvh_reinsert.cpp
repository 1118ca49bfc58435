// Tests of the reinsertion of subtrees: the leaves stay, the tree is sound, and it costs less.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <tuple>

#include "engine/tree/host/build.h"
#include "engine/tree/host/reinsert.h"
#include "tests/cpu/shapes.h"

namespace ballot {
namespace {

using shapes::Triangles;
using Leaf = std::tuple<float, float, float, float, float, float, std::vector<std::uint32_t>>;

std::vector<Leaf> leaves_of(const Bvh& bvh) {
  std::vector<Leaf> leaves;
  for (const BvhNode& n : bvh.nodes) {
    if (n.count == 0) continue;
    const auto first = bvh.references.begin() + n.first;
    leaves.emplace_back(n.lo.x, n.lo.y, n.lo.z, n.hi.x, n.hi.y, n.hi.z,
                        std::vector<std::uint32_t>(first, first + n.count));
  }
  std::sort(leaves.begin(), leaves.end());
  return leaves;
}

// Returns the tree after reinsertion, which is held to check_bvh() and to the leaves of the one before.
Bvh reinserted(const Triangles& triangles, const BuildSettings& settings, const Bvh& before) {
  const Bvh after = reinsert_subtrees(before, settings);
  for (const std::string& line : check_bvh(after, triangles, settings)) ADD_FAILURE() << line;
  EXPECT_EQ(leaves_of(after), leaves_of(before));
  EXPECT_LE(after.stats.sah, before.stats.sah * (1 + 1e-6));
  const double balanced = std::log2(std::max(before.stats.leaves, 1u));
  EXPECT_LE(after.stats.depth, std::max(double(before.stats.depth), 2 * balanced + 10));
  return after;
}

TEST(BvhReinsert, LeavesStayAndTheCostFalls) {
  const std::pair<const char*, Triangles> scenes[] = {{"soup", shapes::soup(3000, 0.3f)},
                                                      {"slivers", shapes::slivers(2000)},
                                                      {"huge and tiny", shapes::huge_and_tiny(1000)},
                                                      {"sphere", shapes::sphere(4)},
                                                      {"far", shapes::moved(shapes::soup(500, 0.3f), {1e7f, 0, 0})},
                                                      {"identical", shapes::identical(300)},
                                                      {"same centroid", shapes::same_centroid(300)}};
  for (const auto& [name, triangles] : scenes) {
    SCOPED_TRACE(name);
    const BuildSettings settings{.builder = BuilderId::Fast};  // whose trees leave most to gain
    const Bvh before = build_bvh(triangles, settings);
    const Bvh after = reinserted(triangles, settings, before);
    if (std::string_view(name) == "soup") {
      EXPECT_LT(after.stats.sah, 0.97 * before.stats.sah);
    }
  }
}

TEST(BvhReinsert, SmallTrees) {
  for (std::size_t count = 0; count < 12; ++count) {
    const Triangles triangles = shapes::soup(count, 0.3f);
    const BuildSettings settings{.max_leaf = 1, .builder = BuilderId::Balanced};
    reinserted(triangles, settings, build_bvh(triangles, settings));
  }
}

// Thousands of boxes that overlap each other. Without a bound a search looks at them all, and reinsertion takes 210
// times as long as in a sphere; with it, about 40 times.
TEST(BvhReinsert, SearchesAmongOverlappingBoxesAreBounded) {
  const auto seconds_of = [](const Triangles& triangles) {
    const BuildSettings settings{.builder = BuilderId::Balanced};
    const Bvh before = build_bvh(triangles, settings);
    const auto start = std::chrono::steady_clock::now();
    reinsert_subtrees(before, settings);
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  EXPECT_LT(seconds_of(shapes::huge_and_tiny(20000)), 110 * seconds_of(shapes::sphere(6)));
}

// Two pairs of neighbours. Each is split between the two sides of the root; the best tree keeps it together.
TEST(BvhReinsert, FindsTheBestOfFourLeaves) {
  const auto at = [](float x) { return Triangle{{{x, 0, 0}, {x + 1, 0, 0}, {x, 1, 1}}}; };
  const Triangles triangles{at(0), at(100), at(1), at(101)};
  BuildNode nodes[7];
  for (std::uint32_t i = 0; i < 4; ++i) {
    nodes[3 + i].box = bounds_of(triangles[i]);
    nodes[3 + i].count = 1;
    nodes[3 + i].prims[0] = i;
  }
  for (int side : {0, 1}) nodes[0].child[side] = &nodes[1 + side];
  for (int i = 0; i < 4; ++i) nodes[1 + i / 2].child[i % 2] = &nodes[3 + i];
  const BuildSettings settings{.max_leaf = 1};
  Bvh before = flatten(nodes, settings);
  before.stats.triangles = 4;
  const Bvh after = reinserted(triangles, settings, before);
  for (const std::uint32_t child : {after.nodes[0].first, after.nodes[0].first + 1})
    EXPECT_FLOAT_EQ(after.nodes[child].hi.x - after.nodes[child].lo.x, 2);
}

TEST(BvhReinsert, IsDeterministic) {
  const Triangles triangles = shapes::soup(5000, 0.3f);
  const BuildSettings settings{.builder = BuilderId::Balanced};
  const Bvh before = build_bvh(triangles, settings);
  const Bvh a = reinsert_subtrees(before, settings), b = reinsert_subtrees(before, settings);
  EXPECT_EQ(a.references, b.references);
  EXPECT_EQ(a.stats.sah, b.stats.sah);
}

}  // namespace
}  // namespace ballot
