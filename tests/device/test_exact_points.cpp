// Holds mode exact of closest points and of the inside test to exact arithmetic over all triangles.
#include <cmath>
#include <random>

#include "engine/answer/point_queries.h"
#include "engine/oracle/nearest.h"
#include "tests/cpu/shapes.h"
#include "tests/device/crossing_test.h"

namespace ballot {
namespace {

constexpr float kNoLimit = std::numeric_limits<float>::infinity();

class ExactPoints : public DeviceTest {};

/// Points in and about triangles, on them, at their corners and edges, and far away.
std::vector<ProbePoint> points_at(const shapes::Triangles& triangles, std::size_t count) {
  shapes::Random random(23);
  const float size = glm::length(triangles.front()[0] - triangles.back()[2]);
  std::vector<ProbePoint> points;
  while (points.size() < count) {
    const Triangle& t = triangles[random.below(triangles.size())];
    points.push_back({t[0] + random.point(size), kNoLimit});
    points.push_back({t[random.below(3)], kNoLimit});
    points.push_back({0.5f * (t[0] + t[1]), kNoLimit});
    points.push_back({(t[0] + t[1] + t[2]) / 3.f + random.point(1e-6f * size), kNoLimit});
    points.push_back({t[0] + random.point(1000 * size), kNoLimit});
  }
  return points;
}

std::uint32_t nearest_of(const glm::vec3& p, const shapes::Triangles& triangles, double& distance) {
  std::uint32_t best = 0;
  ExactDistance least = exact_distance(p, triangles[0]);
  for (std::uint32_t i = 1; i < triangles.size(); ++i)
    if (ExactDistance d = exact_distance(p, triangles[i]); d < least) least = std::move(d), best = i;
  distance = least.distance();
  return best;
}

TEST_F(ExactPoints, DecidedAsByExactArithmetic) {
  const shapes::Triangles cube = shapes::box({0, 0, 0}, {4, 4, 4}), ball = shapes::sphere(2);
  const std::pair<const char*, shapes::Triangles> cases[] = {
      {"ball", ball},
      {"nested", shapes::joined(cube, shapes::box({1, 1, 1}, {3, 3, 3}))},
      {"touching", shapes::joined(cube, shapes::box({4, 0, 0}, {6, 4, 4}))},
      {"far from zero", shapes::moved(shapes::scaled(ball, 100), {1e7f, 3e6f, -1e7f})},
      {"slivers", shapes::slivers(100)},
      {"tiny", shapes::scaled(ball, 1e-30f)},
  };
  for (const auto& [name, triangles] : cases) {
    SCOPED_TRACE(name);
    const auto t = make(*gpu_, triangles, {.split_budget = 2});
    PointQueries queries(*gpu_, t->tracer->tree());
    const std::vector<ProbePoint> points = points_at(triangles, 150);
    std::vector<Nearest> near(points.size());
    std::vector<std::uint32_t> inside(points.size(), 7);
    queries.nearest(points, near, {.exact = true});
    queries.inside(points, inside, {.exact = true});
    for (std::size_t i = 0; i < points.size(); ++i) {
      SCOPED_TRACE(i);
      double distance;
      ASSERT_EQ(near[i].prim, nearest_of(points[i].at, triangles, distance));
      ASSERT_NEAR(near[i].distance, distance, 0x1.01p-24 * distance + 1e-12 * glm::length(points[i].at));
      ASSERT_EQ(inside[i], exact_inside(points[i].at, triangles));
    }
    // A limit of just the distance, and just less.
    std::vector<ProbePoint> limited(points.begin(), points.begin() + 50);
    for (std::size_t i = 0; i < 50; ++i) limited[i].limit = std::nextafter(near[i].distance, i % 2 ? 0.f : kNoLimit);
    std::vector<Nearest> some(50);
    queries.nearest(limited, some, {.exact = true});
    for (std::size_t i = 0; i < 50; i += 2) EXPECT_EQ(some[i].prim, near[i].prim);
  }
}

TEST_F(ExactPoints, DeadPointsAndEqualTriangles) {
  const auto t = make(*gpu_, shapes::identical(20000), {.builder = BuilderId::Balanced});
  PointQueries queries(*gpu_, t->tracer->tree());
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<ProbePoint> points{{{0.25f, 0.25f, 2}, kNoLimit}, {{nan, 0, 0}, kNoLimit}, {{9, 9, 9}, 1}};
  std::vector<Nearest> near(3);
  std::vector<std::uint32_t> inside(3, 7);
  queries.nearest(points, near, {.exact = true});
  queries.inside(points, inside, {.exact = true});
  EXPECT_EQ(near[0].prim, 0u);
  EXPECT_EQ(near[0].distance, 2);
  for (const std::size_t i : {1u, 2u}) EXPECT_TRUE(near[i].prim == NO_HIT && near[i].distance == kNoLimit);
  EXPECT_EQ(inside, (std::vector<std::uint32_t>{0, 0, 0}));
}

/// Random triangles with coordinates of 1e-44 to 1e12, half of them needles along lines through zero.
shapes::Triangles soup_of_every_size(std::size_t count, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(-1, 1);
  std::uniform_int_distribution<int> exponent(-146, 39), doublings(-12, 12);
  const auto any = [&] { return glm::vec3(unit(random), unit(random), unit(random)); };
  const auto sized = [&] { return std::ldexp(1.f, exponent(random)); };
  const auto wild = [&] { return any() * glm::vec3(sized(), sized(), sized()); };
  shapes::Triangles triangles;
  while (triangles.size() < count) {
    triangles.push_back({{wild(), wild(), wild()}});
    const glm::vec3 p = any() * std::ldexp(1.f, doublings(random));
    triangles.push_back({{p, p * -std::ldexp(1.f, doublings(random)), any() * sized()}});
  }
  return triangles;
}

/// Rays at corners, edges and inner points, some from tiny or huge distances.
std::vector<Ray> rays_at(const shapes::Triangles& triangles, std::size_t count, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(-1, 1);
  std::uniform_int_distribution<int> exponent(-60, 30);
  std::vector<Ray> rays;
  for (std::size_t i = 0; rays.size() < count; ++i) {
    const Triangle& t = triangles[i % triangles.size()];
    const glm::vec3 from = glm::vec3(unit(random), unit(random), unit(random)) * std::ldexp(1.f, exponent(random));
    const glm::vec3 to = i % 3 == 0   ? t[i % 2 + 1]
                         : i % 3 == 1 ? 0.5f * t[0] + 0.5f * t[2]
                                      : (t[0] + t[1] + t[2]) / 3.f;
    const Ray ray{from, 0, to - from, 1e30f};
    if (!is_dead(ray)) rays.push_back(ray);
  }
  return rays;
}

// Nearest hits, any hits, numbers of crossings, closest points and the inside test are those of integers over all
// triangles, which know no tree and no rounding.
TEST_F(ExactPoints, EveryAnswerInSoupsOfEverySize) {
  if (!gpu_->info().float64) GTEST_SKIP() << "the device lacks float64";
  std::size_t hits_seen = 0;
  for (const std::uint32_t seed : {1u, 2u, 3u, 4u}) {
    SCOPED_TRACE(seed);
    const shapes::Triangles triangles = soup_of_every_size(50, seed);
    const auto t = make(*gpu_, triangles, {.builder = seed % 2 ? BuilderId::Best : BuilderId::Balanced});
    const std::vector<Ray> rays = rays_at(triangles, 600, 10 + seed);
    std::vector<Hit> nearest(rays.size()), any(rays.size());
    t->tracer->trace(rays, nearest, {.method = "while-while", .numeric = "exact"});
    t->tracer->trace(rays, any, {.want = Want::Any, .method = "while-while", .numeric = "exact"});
    RayQueries crossings(*gpu_, t->tracer->tree());
    const std::vector<std::uint32_t> counts = CrossingTest::counts(crossings, rays, {.exact = true});
    for (std::size_t i = 0; i < rays.size(); ++i) {
      std::optional<ExactSight> best;
      std::uint32_t prim = NO_HIT, crossed = 0;
      for (std::uint32_t k = 0; k < triangles.size(); ++k) {
        const ExactSight sight(rays[i], triangles[k]);
        if (sight.det.sign() == 0 || !sight.within(rays[i])) continue;
        crossed += exact_crosses(rays[i], triangles[k], sight);
        if (sight.hits_line() && (!best || compare_t(sight, *best) < 0)) best = sight, prim = k;
      }
      ASSERT_EQ(nearest[i].prim, prim) << i;
      ASSERT_EQ(any[i].prim == NO_HIT, prim == NO_HIT) << i;
      ASSERT_EQ(counts[i], crossed) << i;
      hits_seen += prim != NO_HIT && prim % 2 == 1;  // needles
    }
    PointQueries queries(*gpu_, t->tracer->tree());
    std::vector<ProbePoint> points;
    for (std::size_t i = 0; i < 300; ++i)
      points.push_back({i % 2 ? rays[i].origin : triangles[i % 50][i % 3], kNoLimit});
    std::vector<Nearest> near(points.size());
    std::vector<std::uint32_t> inside(points.size(), 7);
    queries.nearest(points, near, {.exact = true});
    queries.inside(points, inside, {.exact = true});
    for (std::size_t i = 0; i < points.size(); ++i) {
      double distance;
      ASSERT_EQ(near[i].prim, nearest_of(points[i].at, triangles, distance)) << i;
      ASSERT_EQ(inside[i], exact_inside(points[i].at, triangles)) << i;
    }
  }
  EXPECT_GT(hits_seen, 300u);
}

}  // namespace
}  // namespace ballot
