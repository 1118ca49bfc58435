// Tests of building the BVH, of its flattening and of its statistics.
#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <limits>

#include "engine/core/error.h"
#include "engine/tree/host/build.h"
#include "tests/cpu/shapes.h"

namespace ballot {
namespace {

using shapes::Triangles;

Bvh sound(const Triangles& triangles, const BuildSettings& settings = {}) {
  Bvh bvh = build_bvh(triangles, settings);
  for (const std::string& line : check_bvh(bvh, triangles, settings)) ADD_FAILURE() << line;
  EXPECT_EQ(bvh.stats.triangles, triangles.size());
  EXPECT_FALSE(bvh.stats.from_cache);
  return bvh;
}

TEST(BvhBuild, NoTriangleNoNode) {
  const Bvh bvh = sound({});
  EXPECT_TRUE(bvh.nodes.empty());
  EXPECT_EQ(bvh.stats.depth, 0u);
  EXPECT_EQ(bvh.bounds.hi, glm::vec3(0));
}

TEST(BvhBuild, OneTriangleIsALeaf) {
  const Bvh bvh = sound(shapes::identical(1));
  ASSERT_EQ(bvh.nodes.size(), 2u);
  EXPECT_EQ(bvh.nodes[0].count, 1u);
  EXPECT_EQ(bvh.bounds.hi, glm::vec3(1, 1, 0));
  EXPECT_EQ(bvh.stats.nodes, 1u);
  EXPECT_EQ(bvh.stats.leaves, 1u);
  EXPECT_EQ(bvh.stats.depth, 0u);
  EXPECT_DOUBLE_EQ(bvh.stats.sah, 1);
}

TEST(BvhBuild, SixAndSevenTriangles) {
  for (const std::size_t count : {2u, 6u, 7u, 8u}) {
    const Bvh bvh = sound(shapes::identical(count), {.split_budget = 0});
    EXPECT_EQ(bvh.stats.references, count);
    EXPECT_GE(bvh.stats.leaves, count > 6 ? 2u : 1u);
  }
}

TEST(BvhBuild, Grid) {
  const Bvh bvh = sound(shapes::grid(158));
  EXPECT_GE(bvh.stats.references, 49928u);
  EXPECT_LT(bvh.stats.depth, 40u);
  EXPECT_GT(bvh.stats.sah, 1);
}

TEST(BvhBuild, AGeometricSeriesOfSizesNeedsADeepTree) {
  Triangles triangles;
  for (float x = 1e-12f; x < 1e11f; x *= 1.05f) triangles.push_back({{{x, 0, 0}, {x, x, 0}, {x, 0, x}}});
  sound(triangles);
}

// Embree aborts the process if it splits a set and all of it lies on one side. Each of these scenes made it do that.
TEST(BvhBuild, SplitsNextToVerticesLeaveNoSideEmpty) {
  for (const std::uint32_t seed : {231u, 912u, 1702u, 1747u, 2224u, 2506u, 2663u})
    for (const float budget : {0.1f, 0.25f, 0.5f, 1.0f})
      for (const std::uint32_t leaf : {1u, 2u, 6u})
        sound(shapes::rounded_grid(seed), {.max_leaf = leaf, .split_budget = budget});
}

TEST(BvhBuild, AreasBelowTheRangeOfFloatsAreNotSplit) {
  for (const std::uint32_t seed : {5u, 11u, 29u, 39u, 61u, 69u, 95u})
    for (const float scale : {1e-35f, 1e-37f, 1e-20f}) {
      Triangles tiny = shapes::soup(20 + seed % 40, 1, seed);
      for (Triangle& t : tiny)
        for (glm::vec3& p : t) p *= scale;
      EXPECT_EQ(sound(tiny, {.max_leaf = 1, .split_budget = 16}).stats.references, tiny.size());
    }
}

TEST(BvhBuild, LeafLimitHolds) {
  const Triangles triangles = shapes::soup(500, 0.3f);
  for (std::uint32_t most = 1; most <= 6; ++most) sound(triangles, {.max_leaf = most});
}

TEST(BvhBuild, DegenerateTrianglesAreLeftOutAndCounted) {
  Triangles triangles = shapes::soup(50, 0.3f);
  triangles[7][1] = triangles[7][0];
  triangles[20] = {{{0, 0, 0}, {1, 1, 1}, {3, 3, 3}}};
  triangles[49] = {{{2, 2, 2}, {2, 2, 2}, {2, 2, 2}}};
  const Bvh bvh = sound(triangles, {.split_budget = 0});
  EXPECT_EQ(bvh.stats.degenerate, 3u);
  EXPECT_EQ(bvh.stats.references, 47u);
  EXPECT_TRUE(sound(Triangles(9, Triangle{})).nodes.empty());
}

TEST(BvhBuild, SplitsAddReferencesAndLowerTheCost) {
  const Triangles triangles = shapes::slivers(2000);
  const Bvh without = sound(triangles, {.split_budget = 0});
  const Bvh with = sound(triangles, {.split_budget = 0.5f});
  EXPECT_EQ(without.stats.references, 2000u);
  EXPECT_GT(with.stats.references, 2100u);
  EXPECT_LE(with.stats.references, 3000u);
  EXPECT_LT(with.stats.sah, without.stats.sah);
}

TEST(BvhBuild, IsDeterministic) {
  const Triangles triangles = shapes::soup(2000, 0.3f);
  const Bvh a = build_bvh(triangles), b = build_bvh(triangles);
  EXPECT_EQ(a.references, b.references);
  EXPECT_EQ(a.stats.sah, b.stats.sah);
}

void expect_refused(const Triangles& triangles, const BuildSettings& settings, Failure kind, const std::string& word) {
  try {
    build_bvh(triangles, settings);
    ADD_FAILURE() << "built, expected an error about " << word;
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), kind);
    EXPECT_NE(std::string(e.what()).find(word), std::string::npos) << e.what();
  }
}

TEST(BvhBuild, BadSettingsAreRefused) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  const Triangles one = shapes::identical(1);
  expect_refused(one, {.max_leaf = 0}, Failure::Arguments, "max_leaf is 0");
  expect_refused(one, {.max_leaf = 7}, Failure::Arguments, "max_leaf is 7");
  expect_refused(one, {.split_budget = -0.1f}, Failure::Arguments, "split_budget");
  expect_refused(one, {.split_budget = nan}, Failure::Arguments, "split_budget");
  expect_refused(one, {.traversal_cost = 0}, Failure::Arguments, "traversal_cost");
  expect_refused(one, {.intersection_cost = nan}, Failure::Arguments, "intersection_cost");
}

TEST(BvhBuild, VerticesThatAreNotFiniteAreRefused) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -1e13f}) {
    Triangles triangles = shapes::soup(20, 0.3f);
    triangles[13][2].y = bad;
    expect_refused(triangles, {}, Failure::Work, "triangle 13: coordinate y");
  }
}

TEST(BvhBuild, ProgressRisesToOne) {
  std::vector<double> seen;
  build_bvh(shapes::grid(60), {}, [&](double done) { seen.push_back(done); });
  ASSERT_FALSE(seen.empty());
  EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
  EXPECT_EQ(seen.back(), 1);
}

TEST(BvhBuild, AnExceptionOfProgressComesThrough) {
  struct Stop {};
  EXPECT_THROW(build_bvh(shapes::grid(60), {}, [](double) { throw Stop{}; }), Stop);
}

TEST(BvhFlatten, AChainOfManyNodesNeedsNoStack) {
  constexpr std::uint32_t kLength = 100'000;
  std::deque<BuildNode> nodes;
  const auto leaf = [&](std::uint32_t prim) {
    const glm::vec3 at(static_cast<float>(prim), 0, 0);
    BuildNode& node = nodes.emplace_back();
    node.box = {at, at + 1.f};
    node.count = 1;
    node.prims[0] = prim;
    return &node;
  };
  const BuildNode* root = leaf(0);
  for (std::uint32_t i = 1; i <= kLength; ++i) {
    const BuildNode* other = leaf(i);
    BuildNode& node = nodes.emplace_back();
    node.child[i % 2] = root;
    node.child[1 - i % 2] = other;
    root = &node;
  }
  Bvh bvh = flatten(root, {});
  EXPECT_EQ(bvh.stats.depth, kLength);
  EXPECT_EQ(bvh.stats.references, kLength + 1);
  EXPECT_EQ(bvh.stats.nodes, 2 * kLength + 1);
  EXPECT_EQ(bvh.bounds.hi.x, static_cast<float>(kLength + 1));
  EXPECT_EQ(bvh.nodes[0].first, 2u);
}

TEST(BvhSplit, BoxesCoverTheTriangleAndStayInside) {
  shapes::Random random(11);
  for (const Triangle& t : shapes::huge_and_tiny(2000)) {
    Bounds box = bounds_of(t);
    for (int step = 0; step < 12; ++step) {  // follows one point of the triangle through a chain of splits
      const int axis = static_cast<int>(random.below(3));
      const SplitBoxes parts = split_reference(t, box, axis, random.in(box.lo[axis], box.hi[axis]));
      for (const Bounds& part : {parts.left, parts.right})
        for (int k = 0; k < 3; ++k) {
          ASSERT_LE(part.lo[k], part.hi[k]);
          ASSERT_GE(part.lo[k], box.lo[k]);
          ASSERT_LE(part.hi[k], box.hi[k]);
        }
      for (int sample = 0; sample < 20; ++sample) {
        double u = random.in(0, 1), v = random.in(0, 1);
        if (u + v > 1) u = 1 - u, v = 1 - v;
        const glm::dvec3 p = glm::dvec3(t[0]) * (1 - u - v) + glm::dvec3(t[1]) * u + glm::dvec3(t[2]) * v;
        const double slack = 1e-13 * glm::length(p);
        const auto holds = [&](const Bounds& b, double room) {
          return glm::all(glm::lessThanEqual(glm::dvec3(b.lo) - room, p)) &&
                 glm::all(glm::lessThanEqual(p, glm::dvec3(b.hi) + room));
        };
        ASSERT_TRUE(!holds(box, 0) || holds(parts.left, slack) || holds(parts.right, slack));
      }
      box = random.below(2) == 0 ? parts.left : parts.right;
    }
  }
}

TEST(BvhSplit, ADiagonalGetsSmallBoxes) {
  const Triangle t{{{0, 0, 0}, {1, 1, 1}, {1, 1, 1.001f}}};
  std::vector<Bounds> boxes{bounds_of(t)};
  const double whole = half_area(boxes[0].lo, boxes[0].hi);
  for (int level = 0; level < 3; ++level) {
    std::vector<Bounds> finer;
    for (const Bounds& b : boxes) {
      const SplitBoxes parts = split_reference(t, b, 0, (b.lo.x + b.hi.x) / 2);
      finer.insert(finer.end(), {parts.left, parts.right});
    }
    boxes = finer;
  }
  double sum = 0;
  for (const Bounds& b : boxes) sum += half_area(b.lo, b.hi);
  EXPECT_LT(sum, whole / 7);  // eight boxes, each an eighth of the length, have an eighth of the area
}

}  // namespace
}  // namespace ballot
