// Holds closest points and the inside test to the exact answers.
#include <algorithm>
#include <cmath>

#include "engine/answer/point_queries.h"
#include "engine/oracle/nearest.h"
#include "tests/cpu/shapes.h"
#include "tests/device/fixture.h"

namespace ballot {
namespace {

using namespace harness;

constexpr double kUnit = 0x1p-24;
constexpr float kFar = std::numeric_limits<float>::infinity();

double length(const glm::dvec3& v) { return glm::length(v); }

/// Returns about the distance of a point from a triangle: the exact answer is looked for among the least of these.
double about_distance(const glm::dvec3& p, const Triangle& t) {
  double best = 1e300;
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::dvec3 a = t[i], e = glm::dvec3(t[(i + 1) % 3]) - a;
    const double s = glm::dot(e, e) > 0 ? std::clamp(glm::dot(p - a, e) / glm::dot(e, e), 0.0, 1.0) : 0;
    best = std::min(best, length(p - a - s * e));
  }
  const glm::dvec3 a = t[0], n = glm::cross(glm::dvec3(t[1]) - a, glm::dvec3(t[2]) - a);
  bool over = glm::dot(n, n) > 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::dvec3 v = t[i];
    over = over && glm::dot(glm::cross(n, glm::dvec3(t[(i + 1) % 3]) - v), p - v) >= 0;
  }
  return over ? std::min(best, std::abs(glm::dot(n, p - a)) / length(n)) : best;
}

/// The exact answer for a point.
struct Truth {
  double distance = 0, reach = 0;    // reach: the largest distance of a vertex of the nearest triangle
  std::vector<std::uint32_t> prims;  // all that are exactly as near
  double next = 1e300;               // distance of the nearest of the others
};

Truth truth_of(const glm::vec3& p, const shapes::Triangles& triangles) {
  std::vector<double> about;
  for (const Triangle& t : triangles) about.push_back(about_distance(p, t));
  const double least = *std::ranges::min_element(about);
  Truth truth;
  ExactDistance best;
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    if (about[i] > least + 1e-6 * (least + shapes::reach_of(p, triangles[i]))) {
      truth.next = std::min(truth.next, about[i]);
      continue;
    }
    const ExactDistance d = exact_distance(p, triangles[i]);
    if (!truth.prims.empty() && d > best) {
      truth.next = std::min(truth.next, d.distance());
      continue;
    }
    if (truth.prims.empty() || d < best) {
      if (!truth.prims.empty()) truth.next = std::min(truth.next, best.distance());
      truth.prims.clear();
      best = d;
      truth.reach = shapes::reach_of(p, triangles[i]);
    }
    truth.prims.push_back(i);
  }
  truth.distance = best.distance();
  return truth;
}

/// Points in and about the triangles, on them, at their vertices and edges, and far away.
std::vector<glm::vec3> points_about(const shapes::Triangles& triangles, std::size_t count) {
  shapes::Random random(11);
  Bounds b = bounds_of_vertices(triangles, "points");
  const glm::vec3 middle = 0.5f * b.lo + 0.5f * b.hi, half = 0.5f * (b.hi - b.lo);
  const float size = std::max({half.x, half.y, half.z});
  std::vector<glm::vec3> points;
  while (points.size() < count) {
    const Triangle& t = triangles[random.below(triangles.size())];
    const float s = random.in(0, 1), r = random.in(0, 1) * (1 - s);
    points.push_back(middle + random.point(1.5f * size));
    points.push_back(t[random.below(3)]);
    points.push_back((t[0] + t[1]) * 0.5f);
    points.push_back(t[0] * (1 - s - r) + t[1] * s + t[2] * r);
    points.push_back(t[0] * (1 - s - r) + t[1] * s + t[2] * r + random.point(1e-4f * size));
    if (points.size() % 50 == 0) points.push_back(middle + random.point(1000 * size));
  }
  return points;
}

class PointQueriesTest : public DeviceTest {
 protected:
  static std::vector<Nearest> nearest(PointQueries& queries, std::span<const glm::vec3> points, float limit = kFar) {
    std::vector<ProbePoint> asked;
    for (const glm::vec3& p : points) asked.push_back({p, limit});
    std::vector<Nearest> found(points.size(), Nearest{{}, -1, 7, 0, 0, 0});
    queries.nearest(asked, found);
    return found;
  }
  static std::vector<std::uint32_t> inside(PointQueries& queries, std::span<const glm::vec3> points) {
    std::vector<ProbePoint> asked;
    for (const glm::vec3& p : points) asked.push_back({p, 0});
    std::vector<std::uint32_t> found(points.size(), 7);
    queries.inside(asked, found);
    return found;
  }

  void expect_nearest(const shapes::Triangles& triangles, std::size_t count, const BuildSettings& settings = {}) {
    const auto t = make(*gpu_, triangles, settings);
    PointQueries queries(*gpu_, t->tracer->tree());
    const std::vector<glm::vec3> points = points_about(triangles, count);
    const std::vector<Nearest> found = nearest(queries, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      SCOPED_TRACE(i);
      const Truth truth = truth_of(points[i], triangles);
      ASSERT_LT(found[i].prim, triangles.size());
      const Triangle& reported = triangles[found[i].prim];
      const double reach = shapes::reach_of(points[i], reported), bound = 64 * kUnit * (reach + truth.reach);
      EXPECT_LE(std::abs(found[i].distance - truth.distance), bound);
      EXPECT_LE(about_distance(points[i], reported), truth.distance + bound);
      // The point is on the triangle and as far away as it says, up to its own rounding.
      const double own = bound + 4 * kUnit * length(glm::dvec3(glm::abs(points[i]) + glm::abs(found[i].at)));
      EXPECT_LE(about_distance(found[i].at, reported), own);
      EXPECT_NEAR(length(glm::dvec3(found[i].at) - glm::dvec3(points[i])), found[i].distance, own);
      EXPECT_TRUE(found[i].u >= 0 && found[i].v >= 0 && found[i].u + found[i].v <= 1 + 4 * kUnit);
      if (truth.next <= truth.distance + bound) continue;
      // Of triangles that meet at the nearest point it is the first, unless that lies inside of another by rounding.
      // Far points take any of the nearest.
      const glm::vec3 sides = t->bvh.bounds.hi - t->bvh.bounds.lo;
      const bool far = truth.distance > 8 * std::max({sides.x, sides.y, sides.z});
      const bool at_side = found[i].u == 0 || found[i].v == 0 || found[i].u + found[i].v == 1;
      if (at_side && !far && same_place(triangles, truth.prims)) {
        EXPECT_EQ(found[i].prim, truth.prims.front());
      }
      EXPECT_EQ(std::ranges::count(truth.prims, found[i].prim), 1);
    }
  }

  /// Returns true if all of the triangles share a vertex.
  static bool same_place(const shapes::Triangles& triangles, const std::vector<std::uint32_t>& prims) {
    return std::ranges::any_of(triangles[prims[0]], [&](const glm::vec3& v) {
      return std::ranges::all_of(prims, [&](std::uint32_t i) { return std::ranges::count(triangles[i], v) > 0; });
    });
  }
};

TEST_F(PointQueriesTest, NearestPointsAreThoseOfTheOracle) {
  const std::pair<const char*, shapes::Triangles> cases[] = {
      {"soup", shapes::soup(200, 0.3f)},
      {"sphere", shapes::sphere(2)},
      {"slivers", shapes::slivers(150)},
      {"huge and tiny", shapes::huge_and_tiny(150)},
      {"coplanar", shapes::coplanar(100)},
      {"one", {{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}}},
      {"far from zero", shapes::moved(shapes::scaled(shapes::sphere(2), 512), {1e7f, -1e7f, 0})},
      {"tiny", shapes::scaled(shapes::sphere(1), 1e-12f)},
      {"needles", shapes::scaled(shapes::slivers(100), 1e6f)},
  };
  for (const auto& [name, triangles] : cases) {
    SCOPED_TRACE(name);
    expect_nearest(triangles, 150);
  }
}

TEST_F(PointQueriesTest, AnswersDoNotDependOnTheTree) {
  const shapes::Triangles triangles = shapes::joined(shapes::soup(400, 0.4f), shapes::sphere(3));
  const std::vector<glm::vec3> points = points_about(triangles, 2000);
  const auto first = make(*gpu_, triangles);
  PointQueries queries(*gpu_, first->tracer->tree());
  const std::vector<Nearest> answers = nearest(queries, points);
  for (const BuildSettings& settings :
       {BuildSettings{.max_leaf = 2, .builder = BuilderId::Balanced}, BuildSettings{.builder = BuilderId::Fast}}) {
    const auto other = make(*gpu_, triangles, settings);
    PointQueries again(*gpu_, other->tracer->tree());
    const std::vector<Nearest> same = nearest(again, points);
    std::size_t different = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (points[i] != glm::clamp(points[i], glm::vec3(-10), glm::vec3(10))) continue;  // far points
      different += std::memcmp(&answers[i], &same[i], sizeof(Nearest)) != 0;
    }
    EXPECT_EQ(different, 0u);
  }
}

TEST_F(PointQueriesTest, PointsThatAreHard) {
  const shapes::Triangles triangles = shapes::box({0, 0, 0}, {2, 2, 2});
  const auto t = make(*gpu_, triangles);
  PointQueries queries(*gpu_, t->tracer->tree());
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<glm::vec3> points{{nan, 0, 0}, {0, kFar, 0}, {1e30f, 0, 0}, {1, 1, -3e38f}, {1, 1, 1}, {2, 2, 2}};
  const auto found = nearest(queries, points);
  for (int i : {0, 1}) {
    EXPECT_EQ(found[std::size_t(i)].prim, NO_HIT);
    EXPECT_EQ(found[std::size_t(i)].distance, kFar);
  }
  EXPECT_FLOAT_EQ(found[2].distance, 1e30f);
  EXPECT_FLOAT_EQ(found[3].distance, 3e38f);
  EXPECT_EQ(found[4].distance, 1);
  EXPECT_EQ(found[4].prim, 0u);  // all twelve are as near
  EXPECT_EQ(found[5].distance, 0);
  EXPECT_EQ(found[5].prim, 2u);  // of those at the corner the first
  EXPECT_EQ(inside(queries, points), (std::vector<std::uint32_t>{0, 0, 0, 0, 1, 0}));
  // Limits are kept, and reached.
  EXPECT_EQ(nearest(queries, {&points[4], 1}, 0.999f)[0].prim, NO_HIT);
  EXPECT_EQ(nearest(queries, {&points[4], 1}, 1)[0].prim, 0u);
  EXPECT_EQ(nearest(queries, {&points[5], 1}, 0)[0].prim, 2u);
  EXPECT_EQ(nearest(queries, {&points[4], 1}, nan)[0].prim, NO_HIT);
  const auto empty = make(*gpu_, {});
  PointQueries nothing(*gpu_, empty->tracer->tree());
  EXPECT_EQ(nearest(nothing, points)[4].prim, NO_HIT);
  EXPECT_EQ(inside(nothing, points)[4], 0u);
  EXPECT_TRUE(nearest(nothing, {}).empty());
}

// The walk of such a point takes more steps than Mesa 22.3 lets a loop take.
TEST_F(PointQueriesTest, WalksThatTheDriverCutsShort) {
  const auto t = make(*gpu_, shapes::identical(100000), {.builder = BuilderId::Balanced});
  PointQueries queries(*gpu_, t->tracer->tree());
  const glm::vec3 points[] = {{0.25f, 0.25f, 2}, {-1, 0, 0}};
  const auto found = nearest(queries, points);
  EXPECT_EQ(found[0].prim, 0u);
  EXPECT_EQ(found[0].distance, 2);
  EXPECT_EQ(found[1].prim, 0u);
  EXPECT_EQ(found[1].distance, 1);
}

TEST_F(PointQueriesTest, InsideIsThatOfTheOracle) {
  const shapes::Triangles cube = shapes::box({0, 0, 0}, {4, 4, 4});
  const std::pair<const char*, shapes::Triangles> cases[] = {
      {"cube", cube},
      {"nested", shapes::joined(cube, shapes::box({1, 1, 1}, {3, 3, 3}))},
      {"touching", shapes::joined(cube, shapes::box({4, 0, 0}, {6, 4, 4}))},
      {"touching at an edge", shapes::joined(cube, shapes::box({4, 4, 0}, {6, 6, 4}))},
      {"far from zero", shapes::moved(cube, {1e7f, -1e7f, 1e7f})},
      {"octahedron", shapes::scaled(shapes::sphere(0), 4)},
  };
  for (const auto& [name, triangles] : cases) {
    SCOPED_TRACE(name);
    const auto t = make(*gpu_, triangles);
    PointQueries queries(*gpu_, t->tracer->tree());
    // On the vertices, edges and faces, and beside them: the arithmetic of such points is exact.
    const Bounds b = bounds_of_vertices(triangles, name);
    std::vector<glm::vec3> points;
    for (float x = -1; x <= b.hi.x - b.lo.x + 1; ++x)
      for (float y = -1; y <= b.hi.y - b.lo.y + 1; ++y)
        for (float z = -1; z <= b.hi.z - b.lo.z + 1; ++z) points.push_back(b.lo + glm::vec3(x, y, z));
    const auto found = inside(queries, points);
    for (std::size_t k = 0; k < points.size(); ++k)
      EXPECT_EQ(found[k] != 0, exact_inside(points[k], triangles))
          << points[k].x - b.lo.x << " " << points[k].y - b.lo.y << " " << points[k].z - b.lo.z;
  }
}

TEST_F(PointQueriesTest, InsideIsRightBeyondItsBound) {
  const shapes::Triangles thin = shapes::scaled(shapes::sphere(2), 1);
  const std::pair<const char*, shapes::Triangles> cases[] = {
      {"sphere", shapes::sphere(3)},
      {"thin",
       [&] {
         shapes::Triangles flat = thin;
         for (Triangle& t : flat)
           for (glm::vec3& v : t) v.z *= 1e-4f;
         return flat;
       }()},
      {"far from zero", shapes::moved(shapes::scaled(shapes::sphere(3), 100), {1e7f, 3e6f, -1e7f})},
      {"split", shapes::scaled(shapes::sphere(3), 7)},
  };
  for (const auto& [name, triangles] : cases) {
    SCOPED_TRACE(name);
    const auto t = make(*gpu_, triangles, {.split_budget = 2});
    PointQueries queries(*gpu_, t->tracer->tree());
    const std::vector<glm::vec3> points = points_about(triangles, 600);
    const auto found = inside(queries, points);
    std::size_t judged = 0;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const bool near = std::ranges::any_of(triangles, [&](const Triangle& triangle) {
        return about_distance(points[k], triangle) <= 16 * kUnit * shapes::reach_of(points[k], triangle);
      });
      if (near) continue;
      ++judged;
      EXPECT_EQ(found[k] != 0, exact_inside(points[k], triangles)) << k;
    }
    EXPECT_GT(judged, points.size() / 4);
  }
}

}  // namespace
}  // namespace ballot
