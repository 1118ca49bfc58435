// Tests that the oracle's traversal finds what testing every triangle finds, in both layouts, for easy and hard rays.
#include <gtest/gtest.h>

#include "engine/core/error.h"
#include "engine/oracle/oracle.h"
#include "tests/cpu/shapes.h"

namespace ballot {
namespace {

using shapes::Triangles;

constexpr NodeLayout kLayouts[] = {NodeLayout::Paper, NodeLayout::Interleaved};

void expect_walk_equals_brute_force(const Triangles& triangles, const std::vector<Ray>& rays) {
  const Bvh bvh = build_bvh(triangles);
  std::size_t hits = 0;
  for (const NodeLayout layout : kLayouts) {
    const PairTree device = encode_pairs(bvh, triangles, layout);
    const Oracle oracle(device);
    const std::vector<OracleHit> found = oracle.nearest(rays);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const OracleHit want = oracle.brute_force(rays[i]);
      ASSERT_EQ(found[i].prim, want.prim) << "ray " << i << " at t " << found[i].t << ", expected " << want.t;
      ASSERT_EQ(found[i].t, want.t);
      ASSERT_EQ(found[i].u, want.u);
      hits += want.prim != NO_HIT ? 1 : 0;
    }
  }
  EXPECT_GT(hits, rays.size() / 50);
}

// Rays that start on a face, an edge or a corner of the scene's box and leave along or across it.
std::vector<Ray> rays_on_box_faces(const Triangles& triangles) {
  const Bounds box = build_bvh(triangles).bounds;
  std::vector<Ray> out;
  shapes::Random random(12);
  for (int i = 0; i < 500; ++i) {
    glm::vec3 from, dir = random.point(1);
    for (int k = 0; k < 3; ++k) from[k] = random.below(3) == 0 ? box.lo[k] : random.below(2) == 0 ? box.hi[k] : 0.f;
    if (random.below(2) == 0) dir[static_cast<int>(random.below(3))] = random.below(2) == 0 ? 0.f : -0.f;
    out.push_back({from, 0, dir, 1e30f});
  }
  return out;
}

TEST(Oracle, WalkEqualsBruteForceOnRandomScenes) {
  expect_walk_equals_brute_force(shapes::soup(400, 0.3f), shapes::random_rays(2000));
  expect_walk_equals_brute_force(shapes::slivers(400), shapes::edge_rays(shapes::slivers(400), 1000, {0.5f, 2, 0.25f}));
  expect_walk_equals_brute_force(shapes::sphere(3), shapes::random_rays(1000));
  expect_walk_equals_brute_force(shapes::huge_and_tiny(300), shapes::random_rays(1000, 13, 100));
  expect_walk_equals_brute_force(shapes::same_centroid(300), shapes::random_rays(1000));
}

TEST(Oracle, WalkEqualsBruteForceOnHardRays) {
  for (const Triangles& triangles :
       {shapes::soup(300, 0.3f), shapes::grid(12), shapes::grid(12, 0), shapes::coplanar(300)}) {
    expect_walk_equals_brute_force(triangles, shapes::axis_rays(triangles, 1000));
    expect_walk_equals_brute_force(triangles, rays_on_box_faces(triangles));
  }
}

TEST(Oracle, EqualTrianglesTheSmallestNumberWins) {
  const Triangles triangles = shapes::identical(1000);
  expect_walk_equals_brute_force(triangles, {{{0.2f, 0.2f, 1}, 0, {0, 0, -1}, 5}});
  const PairTree device = encode_pairs(build_bvh(triangles), triangles, NodeLayout::Interleaved);
  const OracleHit hit = Oracle(device).nearest(Ray{{0.25f, 0.5f, 1}, 0, {0, 0, -2}, 5});
  EXPECT_EQ(hit.prim, 0u);
  EXPECT_EQ(hit.t, 0.5);
  EXPECT_EQ(hit.u, 0.25);
  EXPECT_EQ(hit.v, 0.5);
}

class OneTriangle : public testing::Test {
 protected:
  OracleHit trace(const glm::vec3& from, const glm::vec3& dir, float t_min = 0, float t_max = 10) const {
    return Oracle(device_).nearest(Ray{from, t_min, dir, t_max});
  }
  Triangles triangles_ = shapes::identical(1);
  PairTree device_ = encode_pairs(build_bvh(triangles_), triangles_, NodeLayout::Interleaved);
};

TEST_F(OneTriangle, EdgesAndVerticesBelongToIt) {
  for (const glm::vec3 p : {glm::vec3(0), {1, 0, 0}, {0, 1, 0}, {0.5f, 0, 0}, {0, 0.5f, 0}, {0.5f, 0.5f, 0}}) {
    EXPECT_EQ(trace(p + glm::vec3(0, 0, 1), {0, 0, -1}).prim, 0u);
    EXPECT_EQ(trace(p - glm::vec3(0, 0, 1), {-0.f, 0, 1}).prim, 0u);
  }
  EXPECT_EQ(trace({0.5f, -1e-6f, 1}, {0, 0, -1}).prim, NO_HIT);
}

TEST_F(OneTriangle, IntervalIsClosed) {
  const glm::vec3 from(0.25f, 0.25f, 2), down(0, 0, -1);
  EXPECT_EQ(trace(from, down, 0, 2).prim, 0u);
  EXPECT_EQ(trace(from, down, 2, 3).prim, 0u);
  EXPECT_EQ(trace(from, down, 0, 1.9999999f).prim, NO_HIT);
  EXPECT_EQ(trace(from, down, 2.0000002f, 3).prim, NO_HIT);
  EXPECT_EQ(trace(from, -down, -3, 3).t, -2);
  EXPECT_EQ(trace({0.25f, 0.25f, 0}, down).t, 0);
}

TEST_F(OneTriangle, ARayInItsPlaneMisses) {
  EXPECT_EQ(trace({-1, 0.25f, 0}, {1, 0, 0}).prim, NO_HIT);
  EXPECT_EQ(trace({-1, -1, 0}, {1, 1.1f, 0}).prim, NO_HIT);
  EXPECT_EQ(trace({0.25f, 0.25f, 0}, {1, 0, -0.f}).prim, NO_HIT);
}

TEST_F(OneTriangle, DeadRaysMiss) {
  for (const Ray& ray : shapes::dead_rays()) {
    EXPECT_TRUE(is_dead(ray));
    EXPECT_EQ(Oracle(device_).nearest(ray).prim, NO_HIT);
    EXPECT_EQ(Oracle(device_).brute_force(ray).prim, NO_HIT);
  }
  EXPECT_FALSE(is_dead(Ray{{0, 0, 0}, -1, {0, 1e-40f, 1e-30f}, 1e38f}));
}

TEST(Oracle, AnEmptySceneIsMissed) {
  const PairTree device = encode_pairs(build_bvh({}), {}, NodeLayout::Paper);
  EXPECT_EQ(Oracle(device).nearest(Ray{{0, 0, 0}, 0, {0, 0, 1}, 5}).prim, NO_HIT);
  EXPECT_TRUE(Oracle(device).nearest(std::vector<Ray>{}).empty());
}

TEST(Oracle, NoRayLeaksThroughAClosedMesh) {
  const Triangles triangles = shapes::sphere(4);
  const PairTree device = encode_pairs(build_bvh(triangles), triangles, NodeLayout::Interleaved);
  for (const OracleHit& hit : Oracle(device).nearest(shapes::edge_rays(triangles, 50'000, {0.1f, 0.2f, 0})))
    ASSERT_NE(hit.prim, NO_HIT);
}

}  // namespace
}  // namespace ballot
