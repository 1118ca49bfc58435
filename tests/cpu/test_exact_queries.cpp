// Tests that the exact oracles of crossings and of closest points find what exact arithmetic over every triangle finds.
#include <gtest/gtest.h>

#include <algorithm>

#include "engine/oracle/closest.h"
#include "engine/oracle/crossings.h"
#include "engine/oracle/nearest.h"
#include "tests/cpu/brute_crossings.h"
#include "tests/cpu/exact_cases.h"

namespace ballot {
namespace {

using shapes::Triangles;

std::vector<std::uint32_t> prims_of(const std::vector<ExactCrossing>& crossings) {
  std::vector<std::uint32_t> prims;
  for (const ExactCrossing& c : crossings) prims.push_back(c.prim);
  return prims;
}

std::vector<std::pair<const char*, Triangles>> meshes() {
  const Triangles cube = shapes::box({0, 0, 0}, {2, 2, 2});
  return {{"soup", shapes::soup(60, 0.5f)},
          {"slivers", shapes::slivers(60)},
          {"coplanar", shapes::coplanar(40)},
          {"huge and tiny", shapes::huge_and_tiny(40)},
          {"sphere", shapes::sphere(2)},
          {"nested", shapes::joined(cube, shapes::box({0.5f, 0.5f, 0.5f}, {1.5f, 1.5f, 1.5f}))},
          {"touching", shapes::joined(cube, shapes::box({2, 0, 0}, {3, 2, 2}))}};
}

/// Points about triangles, on them, at their edges and corners.
std::vector<glm::vec3> points_at(const Triangles& triangles, std::size_t count) {
  shapes::Random random(17);
  std::vector<glm::vec3> points;
  while (points.size() < count) {
    const Triangle& t = triangles[random.below(triangles.size())];
    points.push_back(random.point(3));
    points.push_back(t[random.below(3)]);
    points.push_back(0.5f * (t[0] + t[1]));
    points.push_back((t[0] + t[1] + t[2]) / 3.f + random.point(1e-5f));
  }
  return points;
}

TEST(ExactQueries, CrossingsEqualBruteForce) {
  for (const auto& [name, triangles] : meshes()) {
    SCOPED_TRACE(name);
    const Bvh bvh = build_bvh(triangles, {.split_budget = 2});
    const PairTree tree = encode_pairs(bvh, triangles, NodeLayout::Centred);
    const ExactCrossings oracle(OracleScene(tree, triangles));
    std::vector<Ray> rays = shapes::random_rays(60, 7, 1);
    for (const std::vector<Ray>& more :
         {shapes::axis_rays(triangles, 80), shapes::edge_rays(triangles, 60, {0.1f, 0.2f, 0.3f})})
      rays.insert(rays.end(), more.begin(), more.end());
    std::size_t all = 0;
    for (const Ray& ray : rays) {
      const std::vector<ExactCrossing> found = oracle.list(ray);
      const std::vector<std::uint32_t> truth = crossings_of(ray, triangles, 0);
      ASSERT_EQ(prims_of(found), truth);
      all += truth.size();
      ASSERT_EQ(prims_of(oracle.list(ray, [](std::uint32_t, bool front) { return front; })),
                crossings_of(ray, triangles, -1));
      ASSERT_EQ(prims_of(oracle.in_order(ray, {truth.rbegin(), truth.rend()})), truth);
      for (const ExactCrossing& c : found) {
        const ExactSight sight(ray, triangles[c.prim]);
        ASSERT_NEAR(c.t, sight.t(), 0x1p-30 * std::abs(sight.t()));
        ASSERT_NEAR(c.u, sight.weight(1), 0x1p-30);
        ASSERT_NEAR(c.v, sight.weight(2), 0x1p-30);
      }
    }
    EXPECT_GT(all, 30u);
    for (const glm::vec3& p : points_at(triangles, 120)) ASSERT_EQ(oracle.inside(p), exact_inside(p, triangles));
  }
}

TEST(ExactQueries, CrossingsOfInstancesEqualBruteForce) {
  const std::vector<Triangles> all{shapes::sphere(2), {}, shapes::soup(60, 0.7f), shapes::box({0, 0, 0}, {1, 1, 1})};
  const Transform sheared{{{1, 0.5f, 0, 1}, {0, 1, 0.25f, 0}, {0.5f, 0, -1, 0}}},
      flat{{{1, 0, 0, 0}, {0, 2, 0, 0}, {0, 0, 1e-4f, 0}}};
  const Placement placements[] = {{0, {}}, {1, {}}, {2, sheared}, {0, {}}, {3, flat}, {3, sheared}, {2, {}}};
  const Forest forest(all, placements, [](std::span<const Triangle> t) { return build_bvh(t, {.split_budget = 2}); });
  const ExactCrossings oracle{OracleScene(forest)};
  std::vector<Ray> rays = shapes::random_rays(60, 7, 1);
  for (const Triangles& mesh : {all[0], all[3]})
    for (const Ray& ray : shapes::edge_rays(mesh, 60, {0.1f, 0.2f, 3})) rays.push_back(ray);
  std::size_t crossings = 0;
  for (const Ray& ray : rays) {
    const std::vector<std::uint32_t> truth = crossings_of(ray, forest);
    ASSERT_EQ(prims_of(oracle.list(ray)), truth);
    ASSERT_EQ(prims_of(oracle.in_order(ray, {truth.rbegin(), truth.rend()})), truth);
    for (const bool front : {false, true})
      ASSERT_EQ(prims_of(oracle.list(ray, [&](std::uint32_t, bool is) { return is == front; })),
                crossings_of(ray, forest, front ? -1 : 1));
    crossings += truth.size();
  }
  EXPECT_GT(crossings, 300u);
}

TEST(ExactQueries, ClosestPointsEqualBruteForce) {
  for (const auto& [name, triangles] : meshes()) {
    SCOPED_TRACE(name);
    const Bvh bvh = build_bvh(triangles);
    const PairTree tree = encode_pairs(bvh, triangles, NodeLayout::Interleaved);
    const ExactClosestPoints oracle(tree);
    for (const glm::vec3& p : points_at(triangles, 60)) {
      std::uint32_t best = 0;
      ExactDistance least = exact_distance(p, triangles[0]);
      for (std::uint32_t i = 1; i < triangles.size(); ++i)
        if (ExactDistance d = exact_distance(p, triangles[i]); d < least) least = std::move(d), best = i;
      const double distance = least.distance();
      const std::pair<std::uint32_t, Triangle> first(0, triangles[0]);
      for (const auto* near : {&first, static_cast<decltype(&first)>(nullptr)}) {
        const ExactClosest found = oracle.nearest(p, std::numeric_limits<float>::infinity(), near);
        ASSERT_EQ(found.prim, best);
        ASSERT_NEAR(found.distance, distance, 1e-12 * (1 + distance));
        ASSERT_NEAR(glm::length(found.at - glm::dvec3(p)), distance, 1e-9 * (1 + distance));
      }
      ASSERT_EQ(oracle.nearest(p, float(0.5 * distance)).prim, distance > 0 ? NO_HIT : best);
      ASSERT_EQ(oracle.nearest(p, float(1.5 * distance)).prim, best);
    }
  }
}

// Among instances it is the first of the nearest of all moved triangles.
TEST(ExactQueries, ClosestPointsAmongInstancesEqualBruteForce) {
  const std::vector<Triangles> meshes{shapes::sphere(1), shapes::soup(40, 0.5f), {}};
  Transform turned, mirrored, far;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) turned.m[r][c] = r == c ? 0.8f : 0.6f / float(1 + r - 2 * c);
  for (int r = 0; r < 3; ++r) mirrored.m[r][r] = r ? 0.01f : -3, far.m[r][3] = 1e6f;
  const Placement placements[] = {{0, {}}, {1, turned}, {0, mirrored}, {2, {}}, {1, far}, {0, turned}};
  const Forest forest(meshes, placements, [](std::span<const Triangle> t) { return build_bvh(t); });
  const Triangles world = moved_triangles(forest);
  const ExactClosestPoints oracle{OracleScene(forest)};
  std::vector<glm::vec3> points = points_at(world, 120);
  points.push_back(glm::vec3(1e6f));
  for (const glm::vec3& p : points) {
    std::uint32_t best = 0;
    ExactDistance least = exact_distance(p, world[0]);
    for (std::uint32_t i = 1; i < world.size(); ++i)
      if (ExactDistance d = exact_distance(p, world[i]); d < least) least = std::move(d), best = i;
    const std::pair<std::uint32_t, Triangle> last(world.size() - 1, world.back());
    for (const auto* near : {&last, static_cast<decltype(&last)>(nullptr)}) {
      const ExactClosest found = oracle.nearest(p, std::numeric_limits<float>::infinity(), near);
      ASSERT_EQ(found.prim, best);
      ASSERT_NEAR(found.distance, least.distance(), 1e-12 * (1 + least.distance()));
    }
  }
}

TEST(ExactQueries, DeadAndEmpty) {
  const Triangles cube = shapes::box({0, 0, 0}, {2, 2, 2});
  const Bvh bvh = build_bvh(cube);
  const PairTree tree = encode_pairs(bvh, cube, NodeLayout::Interleaved);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const Ray& ray : shapes::dead_rays()) EXPECT_TRUE(ExactCrossings(tree).list(ray).empty());
  EXPECT_FALSE(ExactCrossings(tree).inside({nan, 0, 0}));
  EXPECT_EQ(ExactClosestPoints(tree).nearest({nan, 0, 0}, 1).prim, NO_HIT);
  EXPECT_EQ(ExactClosestPoints(tree).nearest({0, 0, 0}, nan).prim, NO_HIT);
  EXPECT_EQ(ExactClosestPoints(tree).nearest({2, 2, 3}, 1).prim, ExactClosestPoints(tree).nearest({2, 2, 3}, 2).prim);
  EXPECT_FALSE(ExactCrossings(tree).inside(glm::vec3(1e30f)));
  EXPECT_NEAR(ExactClosestPoints(tree).nearest(glm::vec3(1e30f), 3e38f).distance, std::sqrt(3.0) * 1e30, 1e25);
}

}  // namespace
}  // namespace ballot
