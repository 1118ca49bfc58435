// Tests of sides: on which side of the nearest surface a point lies. Pseudonormals decide the side, and the side gives
// a distance its sign. On closed meshes it must agree with the exact inside test. On open meshes it must agree with a
// computation in double precision over all triangles.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "engine/answer/point_queries.h"
#include "engine/oracle/nearest.h"
#include "tests/cpu/shapes.h"
#include "tests/device/fixture.h"

namespace ballot {
namespace {

using namespace harness;

constexpr double kUnitRoundoff = 0x1p-24;
constexpr float kAnywhere = std::numeric_limits<float>::infinity();

class Sides : public DeviceTest {
 protected:
  std::vector<Nearest> sides(const shapes::Triangles& triangles, std::span<const glm::vec3> points, bool exact) {
    const auto t = make(*gpu_, triangles);
    PointQueries queries(*gpu_, t->tracer->tree());
    std::vector<ProbePoint> asked;
    for (const glm::vec3& p : points) asked.push_back({p, kAnywhere});
    std::vector<Nearest> found(points.size(), Nearest{{}, -1, 7, 0, 0, 7});
    queries.nearest(asked, found, {.exact = exact, .sides = true});
    return found;
  }
};

/// A sphere whose surface goes in and out.
shapes::Triangles bumpy(int levels) {
  shapes::Triangles t = shapes::sphere(levels);
  for (Triangle& triangle : t)
    for (glm::vec3& v : triangle) v *= 1 + 0.3f * std::sin(7 * v.x) * std::sin(9 * v.y + 2) * std::cos(8 * v.z);
  return t;
}

/// A needle: an octahedron that is thin in y and z. Two of its tips are far sharper than a right angle.
shapes::Triangles needle(float width) {
  shapes::Triangles t = shapes::sphere(0);
  for (Triangle& triangle : t)
    for (glm::vec3& v : triangle) v *= glm::vec3(1, width, width);
  return t;
}

std::vector<glm::vec3> points_near(const shapes::Triangles& triangles, std::size_t count, float size) {
  shapes::Random random(31);
  std::vector<glm::vec3> points;
  while (points.size() < count) {
    const Triangle& t = triangles[random.below(triangles.size())];
    const std::size_t i = random.below(3);
    points.push_back(random.point(1.5f * size));
    points.push_back(t[i] + random.point(0.1f * size));
    points.push_back(0.5f * (t[i] + t[(i + 1) % 3]) + random.point(0.1f * size));
    points.push_back((t[0] + t[1] + t[2]) / 3.f + random.point(0.01f * size));
    points.push_back(t[i]);
    points.push_back(t[i] * 1.001f);
  }
  return points;
}

TEST_F(Sides, OfClosedMeshesTellWhatIsInside) {
  const std::pair<const char*, shapes::Triangles> cases[] = {
      {"octahedron", shapes::sphere(0)},
      {"sphere", shapes::sphere(3)},
      {"bumps", bumpy(3)},
      {"box", shapes::box({-1, -1, -1}, {1, 0.5f, 0.01f})},
      {"needle", needle(0.01f)},
      {"far from zero", shapes::moved(shapes::scaled(bumpy(2), 100), {1e7f, -1e7f, 3e6f})},
      {"tiny", shapes::scaled(bumpy(2), 1e-20f)},
  };
  for (const auto& [name, triangles] : cases) {
    SCOPED_TRACE(name);
    const Bounds b = bounds_of_vertices(triangles, name);
    std::vector<glm::vec3> points = points_near(triangles, 600, 0.5f * (b.hi.x - b.lo.x));
    for (std::size_t i = 0; i < points.size(); i += 6) points[i] += 0.5f * (b.lo + b.hi);
    for (const bool exact : {false, true}) {
      const std::vector<Nearest> found = sides(triangles, points, exact);
      for (std::size_t i = 0; i < points.size(); ++i) {
        ASSERT_LE(found[i].behind, 1u);
        // Points on the surface are left out: they count as not behind it, whatever exact_inside() says of them. In
        // mode watertight, points nearer than `bound` are left out too: rounding may give them the wrong side. Beside
        // an edge this bound holds if the sine of half the angle between the faces is 0.01 or more.
        const double bound = 128 * kUnitRoundoff * shapes::reach_of(points[i], triangles[found[i].prim]) / 0.01;
        if (exact ? found[i].distance == 0 : double(found[i].distance) < bound) continue;
        EXPECT_EQ(found[i].behind != 0, exact_inside(points[i], triangles))
            << i << " exact " << exact << " distance " << found[i].distance;
      }
    }
  }
}

/// Returns the nearest point of a triangle, by Ericson, Real-Time Collision Detection, 5.1.5.
glm::dvec3 nearest_on(const glm::dvec3& p, const Triangle& t) {
  const glm::dvec3 a = t[0], b = t[1], c = t[2], ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap), d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
  const double d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
  if (d1 <= 0 && d2 <= 0) return a;
  if (d3 >= 0 && d4 <= d3) return b;
  if (d6 >= 0 && d5 <= d6) return c;
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
  if (va <= 0 && d4 >= d3 && d5 >= d6) return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  return a + vb / (va + vb + vc) * ab + vc / (va + vb + vc) * ac;
}

/// Returns the cosine between N and P - C, by brute force. P is the point, and C is the nearest point on the triangles.
/// N is the sum of the normals of all triangles that hold C, each weighted by the angle that its triangle covers around
/// C. Returns 0 where that is in doubt: P is nearly on the surface, there are two nearest points, or C is nearly but
/// not quite on an edge or at a corner.
double side_of(const glm::dvec3& p, const shapes::Triangles& triangles) {
  double least = 1e300;
  glm::dvec3 c(0);
  for (const Triangle& t : triangles) {
    const glm::dvec3 on = nearest_on(p, t);
    if (const double d = glm::length(on - p); d < least) least = d, c = on;
  }
  glm::dvec3 n(0);
  for (const Triangle& t : triangles) {
    const glm::dvec3 on = nearest_on(c, t);
    if (glm::length(nearest_on(p, t) - p) < least * (1 + 1e-6) && glm::length(on - c) > 1e-6) return 0;  // a tie
    if (glm::length(on - c) > 1e-12) continue;
    // The angle at C: a full turn inside the triangle, half a turn on an edge, the corner's own angle at a corner.
    double angle = 2 * std::numbers::pi;
    for (std::size_t i = 0; i < 3; ++i) {
      const glm::dvec3 v = t[i], ahead = glm::normalize(glm::dvec3(t[(i + 1) % 3]) - v);
      const glm::dvec3 back = glm::normalize(glm::dvec3(t[(i + 2) % 3]) - v);
      const double beside = glm::length(glm::cross(ahead, c - v));
      if (glm::length(c - v) < 1e-12) {
        angle = std::acos(glm::dot(ahead, back));
        break;
      }
      if (glm::length(c - v) < 1e-6 || (beside > 1e-12 && beside < 1e-6)) return 0;
      if (beside <= 1e-12) angle = std::numbers::pi;
    }
    n += angle * glm::normalize(glm::cross(glm::dvec3(t[1]) - glm::dvec3(t[0]), glm::dvec3(t[2]) - glm::dvec3(t[0])));
  }
  return least > 1e-5 ? glm::dot(glm::normalize(n), (p - c) / least) : 0;
}

TEST_F(Sides, OfOpenMeshesAreThoseOfBruteForce) {
  shapes::Triangles bowl = bumpy(2), torn = bumpy(2);
  std::erase_if(bowl, [](const Triangle& t) { return t[0].z + t[1].z + t[2].z > 0.5f; });
  for (std::size_t i = 0; i < torn.size(); i += 5) torn.erase(torn.begin() + std::ptrdiff_t(i));
  const std::pair<const char*, shapes::Triangles> cases[] = {
      {"bowl", bowl}, {"torn", torn}, {"hills", shapes::grid(8, 0.5f)}, {"one", {{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}}}};
  for (const auto& [name, triangles] : cases) {
    SCOPED_TRACE(name);
    const std::vector<glm::vec3> points = points_near(triangles, 600, 1);
    for (const bool exact : {false, true}) {
      const std::vector<Nearest> found = sides(triangles, points, exact);
      std::size_t judged = 0;
      for (std::size_t i = 0; i < points.size(); ++i) {
        const double side = side_of(points[i], triangles);
        if (std::abs(side) < 1e-4) continue;
        ++judged;
        EXPECT_EQ(found[i].behind != 0, side < 0) << i << " exact " << exact << ": " << side;
      }
      EXPECT_GT(judged, points.size() / 2);
    }
  }
}

// Two triangles that meet at a sharp edge. The points lie beyond the edge, in front of the surface, yet most are behind
// one of the two triangles. The same at the tip of a spike: most points are behind some triangle that meets there.
TEST_F(Sides, AtEdgesAndCornersWhereOneNormalFails) {
  const glm::vec3 up(-1, 0.2f, 0), down(-1, -0.2f, 0), back(0, 0, -1), front(0, 0, 1);
  const shapes::Triangles wedge{{{front, back, up}}, {{back, front, down}}};
  const std::vector<glm::vec3> beyond{{0.1f, 0.1f, 0}, {0.1f, -0.1f, 0}, {0.5f, 0, 0.5f}, {1e-3f, 0.9e-3f, 0.3f}};
  const shapes::Triangles spike = needle(0.1f);
  std::vector<glm::vec3> past;
  for (const float y : {-0.2f, 0.f, 0.2f})
    for (const float z : {-0.15f, 0.f, 0.15f}) past.push_back({1.1f, y, z});
  for (const bool exact : {false, true}) {
    for (const Nearest& n : sides(wedge, beyond, exact)) EXPECT_EQ(n.behind, 0u);
    for (const Nearest& n : sides(spike, past, exact)) {
      EXPECT_EQ(n.at, glm::vec3(1, 0, 0));
      EXPECT_EQ(n.behind, 0u);
    }
    // Turned inside out, all of them are inside.
    shapes::Triangles turned = spike;
    for (Triangle& t : turned) std::swap(t[1], t[2]);
    for (const Nearest& n : sides(turned, past, exact)) EXPECT_EQ(n.behind, 1u);
  }
  EXPECT_EQ(sides(wedge, std::array{glm::vec3(-0.5f, 0.01f, 0)}, true)[0].behind, 1u);
  const auto is_misleading = [&](const glm::vec3& p) {
    return std::ranges::any_of(spike, [&](const Triangle& t) {
      return std::ranges::count(t, glm::vec3(1, 0, 0)) && glm::dot(glm::cross(t[1] - t[0], t[2] - t[0]), p - t[0]) < 0;
    });
  };
  EXPECT_GE(std::ranges::count_if(past, is_misleading), 6);
}

TEST_F(Sides, AreNotThereUnlessAskedFor) {
  const auto t = make(*gpu_, shapes::sphere(1));
  PointQueries queries(*gpu_, t->tracer->tree());
  const ProbePoint asked[] = {{{0, 0, 0}, kAnywhere}, {{NAN, 0, 0}, kAnywhere}, {{3, 0, 0}, 1}};
  Nearest found[3];
  queries.nearest(asked, found);
  EXPECT_EQ(found[0].behind, 0u);
  queries.nearest(asked, found, {.sides = true});
  EXPECT_EQ(found[0].behind, 1u);
  for (int i : {1, 2}) EXPECT_TRUE(found[i].prim == NO_HIT && found[i].behind == 0);
  const auto none = make(*gpu_, {});
  PointQueries nothing(*gpu_, none->tracer->tree());
  nothing.nearest(asked, found, {.exact = true, .sides = true});
  EXPECT_EQ(found[0].prim, NO_HIT);
}

}  // namespace
}  // namespace ballot
