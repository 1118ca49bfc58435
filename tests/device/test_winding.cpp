// Winding numbers beside the sum over all triangles in double precision.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/answer/point_queries.h"
#include "tests/device/arrays_there.h"
#include "tests/device/fixture.h"
#include "tests/device/forests.h"

namespace ballot {
namespace {

using namespace forests;

double winding_of(const glm::dvec3& p, std::span<const Triangle> triangles) {
  double sum = 0;
  for (const Triangle& t : triangles) {
    const glm::dvec3 a = glm::dvec3(t[0]) - p, b = glm::dvec3(t[1]) - p, c = glm::dvec3(t[2]) - p;
    const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
    sum += 2 * std::atan2(glm::dot(a, glm::cross(b - a, c - a)),
                          la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb);
  }
  return sum / (4 * std::numbers::pi);
}

shapes::Triangles holed(shapes::Triangles t) {
  std::erase_if(t, [](const Triangle& triangle) { return triangle[0].x > 0.7f; });
  return t;
}

class Winding : public DeviceTest {
 protected:
  static std::vector<ProbePoint> points_around(const shapes::Triangles& triangles, std::size_t count) {
    const Bounds b = bounds_of_vertices(triangles, "points");
    const glm::vec3 half = 0.5f * (b.hi - b.lo), middle = b.lo + half;
    const float reach = 1.5f * std::max({half.x, half.y, half.z});
    shapes::Random random(3);
    std::vector<ProbePoint> points;
    for (std::size_t i = 0; i < count; ++i)
      points.push_back({middle + random.point(i % 8 ? reach : i % 16 ? 0.1f * reach : 50 * reach), 0});
    return points;
  }
  /// Returns the largest difference from the truth.
  static double error_of(const shapes::Triangles& triangles, float beta, BuilderId builder = BuilderId::Balanced) {
    const auto t = make(*gpu_, triangles, {.builder = builder});
    const std::vector<ProbePoint> points = points_around(triangles, 1500);
    std::vector<float> found(points.size(), -7);
    PointQueries(*gpu_, t->tracer->tree()).winding(points, found, {.beta = beta});
    double most = 0;
    for (std::size_t i = 0; i < points.size(); ++i)
      most = std::max(most, std::abs(double(found[i]) - winding_of(points[i].at, triangles)));
    return most;
  }
};

TEST_F(Winding, IsThatOfAllTriangles) {
  const shapes::Triangles cases[] = {shapes::sphere(3),
                                     holed(shapes::sphere(4)),
                                     shapes::soup(900, 0.2f),
                                     shapes::moved(shapes::sphere(2), {1000, -50, 7}),
                                     shapes::scaled(shapes::sphere(2), 1e-9f),
                                     shapes::soup(1, 1)};
  for (const shapes::Triangles& triangles : cases) {
    EXPECT_LT(error_of(triangles, 2), 0.02);
    EXPECT_LT(error_of(triangles, 4), 0.002);
    EXPECT_LT(error_of(triangles, 1e6f), 1e-5);
  }
}

// A tree with spatial splits is not walked: each triangle counts once.
TEST_F(Winding, OfOtherTrees) {
  const shapes::Triangles ball = holed(shapes::sphere(4));
  EXPECT_LT(error_of(ball, 4, BuilderId::Best), 0.002);
}

TEST_F(Winding, OfDeadPointsAndEmptyScenes) {
  const auto ball = make(*gpu_, shapes::sphere(2)), none = make(*gpu_, {});
  const std::vector<ProbePoint> points{{{NAN, 0, 0}, 0}, {{0, INFINITY, 0}, 0}, {{0, 0, 0}, 0}, {{3e38f, 0, 0}, 0}};
  std::vector<float> found(4, 7);
  PointQueries(*gpu_, ball->tracer->tree()).winding(points, found);
  EXPECT_TRUE(found[0] == 0 && found[1] == 0 && std::abs(found[2] - 1) < 0.08f && std::abs(found[3]) < 1e-5f);
  PointQueries(*gpu_, none->tracer->tree()).winding(points, found);
  for (const float w : found) EXPECT_EQ(w, 0);
}

// The walk takes more steps than Mesa 22.3 lets a loop take. Arrays on the device have the same answers.
TEST_F(Winding, WalksThatTheDriverCutsShort) {
  const auto t = make(*gpu_, shapes::identical(60000), {.builder = BuilderId::Balanced});
  PointQueries queries(*gpu_, t->tracer->tree());
  const std::vector<ProbePoint> points{{{0.25f, 0.25f, 0.5f}, 0}, {{0.25f, 0.25f, -2}, 0}};
  std::vector<float> found(2), there(2);
  queries.winding(points, found, {.beta = 1e6f});
  for (std::size_t i = 0; i < 2; ++i) {
    const double expected = winding_of(points[i].at, shapes::identical(60000));
    EXPECT_NEAR(found[i], expected, 1e-4 * std::abs(expected));
  }
  Buffer<ProbePoint> asked(*gpu_, 2, Access::Storage, "points");
  Buffer<float> answers(*gpu_, 2, Access::Storage, "answers");
  asked.upload(points);
  queries.winding({asked, 2}, answers, {.beta = 1e6f});
  answers.download(there);
  EXPECT_EQ(found, there);
}

TEST_F(Winding, RefusesWhatItCannotAnswer) {
  Forest forest = make_forest(three_meshes(), twelve_instances());
  DeviceTree tree(*gpu_, forest);
  const auto ball = make(*gpu_, shapes::sphere(1));
  const std::vector<ProbePoint> points{{{0, 0, 0}, 0}};
  std::vector<float> found(1);
  EXPECT_THROW(PointQueries(*gpu_, tree).winding(points, found), Error);
  for (const PointQuery& query : {PointQuery{.beta = 0.5f}, PointQuery{.beta = NAN}, PointQuery{.exact = true}})
    EXPECT_THROW(PointQueries(*gpu_, ball->tracer->tree()).winding(points, found, query), Error);
}

}  // namespace
}  // namespace ballot
