// Tests that the exact oracle, with its filter and tree, finds the same hits as exact arithmetic over every triangle.
#include <gtest/gtest.h>

#include "engine/core/error.h"
#include "engine/oracle/exact.h"
#include "engine/oracle/oracle.h"
#include "tests/cpu/exact_cases.h"

namespace ballot {
namespace {

using exact_cases::PlainTree;
using exact_cases::transformed;
using shapes::Triangles;

std::size_t compare(const PairTree& device, const std::vector<Ray>& rays) {
  const ExactOracle oracle(device);
  const std::vector<ExactHit> found = oracle.nearest(rays);
  std::size_t hits = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const ExactHit want = oracle.brute_force(rays[i]);
    EXPECT_EQ(found[i].prim, want.prim) << "ray " << i << " at t " << found[i].t << ", expected " << want.t;
    EXPECT_EQ(found[i].t, want.t);
    EXPECT_EQ(found[i].u, want.u);
    EXPECT_EQ(found[i].v, want.v);
    EXPECT_EQ(oracle.hit(rays[i], want.prim).t, want.t);
    hits += want.prim != NO_HIT ? 1 : 0;
    if (testing::Test::HasFailure()) break;
  }
  EXPECT_EQ(oracle.counts().rays, rays.size());
  return hits;
}

void expect_same_as_brute_force(const Triangles& triangles, const std::vector<Ray>& rays, bool embree = true) {
  const Bvh bvh = embree ? build_bvh(triangles) : PlainTree(triangles).bvh();
  EXPECT_GT(compare(encode_pairs(bvh, triangles, NodeLayout::Interleaved), rays), 0u) << "the rays show little";
}

std::vector<Ray> rays_at(const Triangles& triangles, std::size_t count, std::uint32_t seed = 31) {
  shapes::Random random(seed);
  std::vector<Ray> out;
  while (out.size() < count) out.push_back(exact_cases::ray_at(triangles[random.below(triangles.size())], random));
  return out;
}

TEST(ExactOracle, WalkEqualsBruteForce) {
  for (const Triangles& triangles : {shapes::soup(60, 0.5f), shapes::slivers(60), shapes::same_centroid(40),
                                     shapes::coplanar(60), shapes::huge_and_tiny(60), shapes::sphere(1)}) {
    std::vector<Ray> rays = shapes::random_rays(100, 7, 1);
    for (const std::vector<Ray>& more : {rays_at(triangles, 150), shapes::axis_rays(triangles, 100)})
      rays.insert(rays.end(), more.begin(), more.end());
    expect_same_as_brute_force(triangles, rays);
  }
}

TEST(ExactOracle, WalkEqualsBruteForceFarFromOne) {
  const Triangles soup = shapes::soup(50, 0.5f);
  for (const float scale : {1e-30f, 1e-12f, 1e10f}) {
    expect_same_as_brute_force(transformed(soup, scale), transformed(rays_at(soup, 100), scale));
    expect_same_as_brute_force(transformed(soup, scale), transformed(shapes::axis_rays(soup, 100), scale));
  }
  const glm::vec3 utm(465000, 5247000, 550);
  const Triangles terrain = transformed(shapes::grid(6), 10, utm);
  expect_same_as_brute_force(terrain, transformed(shapes::edge_rays(shapes::grid(6), 300, {0.1f, 2, 0.2f}), 10, utm));
  expect_same_as_brute_force(terrain, shapes::axis_rays(terrain, 200));
}

TEST(ExactOracle, WalkEqualsBruteForceAtTheEndsOfFloat32) {
  const Triangles soup = shapes::soup(50, 0.5f);
  for (const float scale : {1e-42f, 1e-38f, 1e30f, 1e38f}) {
    std::vector<Ray> rays = transformed(rays_at(soup, 100), scale);
    for (Ray& ray : rays)
      if (scale < 1) ray.dir *= 1e20f;  // a direction below 1e-38 is dead
    expect_same_as_brute_force(transformed(soup, scale), rays, false);
  }
  shapes::Random random(32);
  Triangles triangles;
  for (int i = 0; i < 80; ++i)
    triangles.push_back(
        {exact_cases::awkward_point(random), exact_cases::awkward_point(random), exact_cases::awkward_point(random)});
  std::vector<Ray> rays;
  while (rays.size() < 200)
    rays.push_back({exact_cases::awkward_point(random), -1e38f, exact_cases::awkward_point(random), 1e38f});
  expect_same_as_brute_force(triangles, rays, false);
}

TEST(ExactOracle, WalkEqualsBruteForceOnIntegers) {
  shapes::Random random(33);
  const auto point = [&] {
    const auto at = [&] { return static_cast<float>(random.below(7)) - 3; };
    const float x = at(), y = at(), z = at();
    return glm::vec3(x, y, z);
  };
  Triangles triangles;
  for (int i = 0; i < 80; ++i) triangles.push_back({point(), point(), point()});
  std::vector<Ray> rays;
  while (rays.size() < 400) rays.push_back({point(), static_cast<float>(random.below(2)), point(), 3});
  expect_same_as_brute_force(triangles, rays);
  expect_same_as_brute_force(shapes::grid(4, 0), shapes::axis_rays(shapes::grid(4, 0), 300));
}

class OneExactTriangle : public testing::Test {
 protected:
  ExactHit trace(const glm::vec3& from, const glm::vec3& dir, float t_min = 0, float t_max = 10) const {
    return ExactOracle(device_).nearest(Ray{from, t_min, dir, t_max});
  }
  Triangles triangles_ = shapes::identical(1);  // (0,0,0) (1,0,0) (0,1,0)
  PairTree device_ = encode_pairs(build_bvh(triangles_), triangles_, NodeLayout::Interleaved);
};

TEST_F(OneExactTriangle, EdgesAndVerticesBelongToItAndNothingBeside) {
  for (const glm::vec3 p : {glm::vec3(0), {1, 0, 0}, {0, 1, 0}, {0.5f, 0, 0}, {0, 0.5f, 0}, {0.5f, 0.5f, 0}}) {
    EXPECT_EQ(trace(p + glm::vec3(0, 0, 1), {0, 0, -1}).prim, 0u);
    EXPECT_EQ(trace(p - glm::vec3(0, 0, 1), {-0.f, 0, 1e-30f}, 0, 1e38f).prim, 0u);
    EXPECT_EQ(trace(p - glm::vec3(3, 4, 5) * 7.f, {3, 4, 5}).t, 7);
  }
  EXPECT_EQ(trace({0.5f, -1e-45f, 1}, {0, 0, -1}).prim, NO_HIT);
  EXPECT_EQ(trace({0.5f, 0.50000006f, 1}, {0, 0, -1}).prim, NO_HIT);
  EXPECT_EQ(trace({0.5f, 0, 1}, {0, -1e-45f, -1}).prim, NO_HIT);
  EXPECT_EQ(trace({0.5f, 0, 1}, {0, 1e-45f, -1}).prim, 0u);
}

TEST_F(OneExactTriangle, IntervalIsClosed) {
  const glm::vec3 from(0.25f, 0.25f, 3), down(0, 0, -3);
  const float below = std::nextafter(1.f, 0.f), above = std::nextafter(1.f, 2.f);
  EXPECT_EQ(trace(from, down, 0, 1).t, 1);
  EXPECT_EQ(trace(from, down, 1, 2).t, 1);
  EXPECT_EQ(trace(from, down, 0, below).prim, NO_HIT);
  EXPECT_EQ(trace(from, down, above, 2).prim, NO_HIT);
  // The exact t is 1 / 3, which is no float32: one of the neighbours is below it, the other above.
  const float third = 1.f / 3;
  EXPECT_GT(double{third}, 1.0 / 3);
  EXPECT_EQ(trace({0.25f, 0.25f, 1}, down, 0, third).t, 1.0 / 3);
  EXPECT_EQ(trace({0.25f, 0.25f, 1}, down, 0, std::nextafter(third, 0.f)).prim, NO_HIT);
  EXPECT_EQ(trace({0.25f, 0.25f, 1}, down, third, 1).prim, NO_HIT);
  EXPECT_EQ(trace({0.25f, 0.25f, 0}, down).t, 0);
  EXPECT_EQ(trace(from, -down, -1, 0).t, -1);
}

TEST_F(OneExactTriangle, WhatIsNeverHit) {
  EXPECT_EQ(trace({-1, 0.25f, 0}, {1, 0, 0}).prim, NO_HIT);
  EXPECT_EQ(trace({-1, -1, 0}, {1, 1.1f, 0}).prim, NO_HIT);
  EXPECT_EQ(trace({0.25f, 0.25f, 0}, {1, 0, -0.f}).prim, NO_HIT);
  for (const Ray& ray : shapes::dead_rays()) {
    EXPECT_EQ(ExactOracle(device_).nearest(ray).prim, NO_HIT);
    EXPECT_EQ(ExactOracle(device_).brute_force(ray).prim, NO_HIT);
    EXPECT_FALSE(ExactOracle(device_).hits(ray, 0));
  }
  // Three points on a line whose edges are not exact in double precision. The test keeps this degenerate triangle in
  // the tree on purpose.
  const Triangles line{{{{1, 1, 0}, {3e20f, 3e20f, 0}, {-1e-20f, -1e-20f, 0}}}};
  const PairTree device = encode_pairs(PlainTree(line).bvh(), line, NodeLayout::Paper);
  EXPECT_FALSE(ExactOracle(device).hits({{1, 1, 1}, 0, {0, 0, -1}, 9}, 0));
  EXPECT_EQ(ExactOracle(device).nearest(Ray{{1, 1, 1}, 0, {0, 0, -1}, 9}).prim, NO_HIT);
}

TEST(ExactOracle, EqualTTheSmallestNumberWins) {
  const Triangles equal = shapes::identical(40);
  const PairTree device = encode_pairs(build_bvh(equal), equal, NodeLayout::Interleaved);
  const ExactOracle oracle(device);
  const Ray ray{{0.2f, 0.3f, 0.7f}, 0, {0.1f, 0.1f, -1}, 5};
  EXPECT_EQ(oracle.nearest(ray).prim, 0u);
  EXPECT_EQ(oracle.compare_t(ray, 3, 17), std::strong_ordering::equal);
  EXPECT_EQ(oracle.counts().order_failures, 39u);
  // Different triangles of one plane that meet in a point. 0.1, 0.2 and 0.3 are not exact, but the point is.
  const glm::vec3 p(0.1f, 0.2f, 0.3f);
  const Triangles fan{{p + glm::vec3(1, 0, 0), p, p + glm::vec3(0, 1, 0)},
                      {p, p + glm::vec3(0, 1, 0), p + glm::vec3(-1, 0, 0)},
                      {p + glm::vec3(0, -1, 1), p + glm::vec3(1, 0, 1), p}};
  const PairTree fan_device = encode_pairs(PlainTree(fan).bvh(), fan, NodeLayout::Interleaved);
  const ExactOracle of_fan(fan_device);
  const Ray at_tip{p + glm::vec3(0, 0, 1), 0, {0, 0, -1}, 5};
  EXPECT_EQ(of_fan.nearest(at_tip).prim, 0u);
  EXPECT_EQ(of_fan.compare_t(at_tip, 0, 2), std::strong_ordering::equal);
}

// The t of the two triangles differ by less than double precision can tell.
TEST(ExactOracle, OrdersWhatDoubleCannot) {
  const float up = std::nextafter(1.f, 2.f);
  const Triangles pair{{{{-1, -1, 1}, {3, -1, 1}, {-1, 3, 1}}}, {{{-1, -1, 1}, {3, -1, 1}, {-1e10f, 3e10f, up}}}};
  const PairTree device = encode_pairs(PlainTree(pair).bvh(), pair, NodeLayout::Interleaved);
  const ExactOracle oracle(device);
  const Ray ray{{0, -0.9999999f, 0}, 0, {0, 0, 1}, 5};
  EXPECT_EQ(oracle.hit(ray, 0).t, 1);
  EXPECT_EQ(oracle.hit(ray, 1).t, 1);
  EXPECT_EQ(oracle.compare_t(ray, 0, 1), std::strong_ordering::less);
  EXPECT_EQ(oracle.compare_t(ray, 1, 0), std::strong_ordering::greater);
  const Ray back{{0, -0.9999999f, 2}, 0, {0, 0, -1}, 5};
  EXPECT_EQ(oracle.nearest(ray).prim, 0u);
  EXPECT_EQ(oracle.nearest(back).prim, 1u);
  EXPECT_EQ(oracle.counts().order_failures, 2u);
}

TEST(ExactOracle, AxisAlignedRaysNeedNoIntegers) {
  const Triangles flat = shapes::coplanar(50);  // z = 0.5
  const PairTree device = encode_pairs(build_bvh(flat), flat, NodeLayout::Interleaved);
  const ExactOracle oracle(device);
  shapes::Random random(34);
  for (int i = 0; i < 200; ++i) {
    glm::vec3 from = random.point(1), along = random.point(1);
    from.z = 0.5f;
    along.z = 0;
    EXPECT_EQ(oracle.nearest(Ray{from, -1, along, 1}).prim, NO_HIT);
  }
  EXPECT_GT(oracle.counts().triangle_tests, 200u);
  EXPECT_EQ(oracle.counts().side_failures, 0u);
  const Triangles one = shapes::identical(1);
  const PairTree corner = encode_pairs(build_bvh(one), one, NodeLayout::Interleaved);
  const ExactOracle of_one(corner);
  EXPECT_EQ(of_one.nearest(Ray{{0.3f, 0, 1}, 0, {0, 0, -1}, 5}).prim, 0u);
  EXPECT_EQ(of_one.nearest(Ray{{0, 0, 1}, 0, {0, 0, -1}, 5}).prim, 0u);
  EXPECT_EQ(of_one.counts().side_failures, 0u);
}

TEST(ExactOracle, NoRayLeaksThroughAClosedMesh) {
  const Triangles triangles = shapes::sphere(4);
  const PairTree device = encode_pairs(build_bvh(triangles), triangles, NodeLayout::Interleaved);
  for (const ExactHit& hit : ExactOracle(device).nearest(shapes::edge_rays(triangles, 20'000, {0.1f, 0.2f, 0})))
    ASSERT_NE(hit.prim, NO_HIT);
}

TEST(ExactOracle, EmptyScenesAndWrongArguments) {
  const PairTree empty = encode_pairs(build_bvh({}), {}, NodeLayout::Paper);
  const ExactOracle oracle(empty);
  EXPECT_EQ(oracle.nearest(Ray{{0, 0, 0}, 0, {0, 0, 1}, 5}).prim, NO_HIT);
  EXPECT_TRUE(oracle.nearest(std::vector<Ray>{}).empty());
  EXPECT_THROW(oracle.compare_t({{0, 0, 0}, 0, {0, 0, 1}, 5}, 0, 1), Error);
  const Triangles one = shapes::identical(1);
  const PairTree device = encode_pairs(build_bvh(one), one, NodeLayout::Paper);
  EXPECT_THROW(ExactOracle(device).compare_t({{0, 0, 0}, 0, {1, 0, 0}, 5}, 0, 0), Error);
}

TEST(ExactOracle, ProgressGrowsToOne) {
  const Triangles soup = shapes::soup(50, 0.5f);
  const PairTree device = encode_pairs(build_bvh(soup), soup, NodeLayout::Interleaved);
  double last = 0;
  ExactOracle(device).nearest(shapes::random_rays(5000), [&](double done) {
    EXPECT_GT(done, last);
    last = done;
  });
  EXPECT_EQ(last, 1);
}

}  // namespace
}  // namespace ballot
