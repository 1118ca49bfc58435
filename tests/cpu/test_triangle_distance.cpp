// The distance of two triangles, beside that of quadruple precision.
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <random>

#include "engine/core/triangle_distance.h"

namespace ballot {
namespace {

namespace wide = boost::multiprecision;
using Wide = wide::number<wide::cpp_bin_float<300, wide::digit_base_2>>;
using Vec = std::array<Wide, 3>;

Vec widened(const glm::dvec3& v) { return {Wide(v.x), Wide(v.y), Wide(v.z)}; }
Vec operator-(const Vec& a, const Vec& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vec along(const Vec& p, const Vec& d, const Wide& s) { return {p[0] + d[0] * s, p[1] + d[1] * s, p[2] + d[2] * s}; }
Wide dot(const Vec& a, const Vec& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vec cross(const Vec& a, const Vec& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Wide clamped(const Wide& x) { return x < 0 ? Wide(0) : x > 1 ? Wide(1) : x; }

/// Returns the squared distance of two segments: of the quadratic function of both places, its least value in the
/// square of the places, on its sides or inside.
Wide of_segments(const Vec& p, const Vec& q, const Vec& r, const Vec& s) {
  const Vec u = q - p, v = s - r, w = p - r;
  const Wide a = dot(u, u), b = dot(u, v), c = dot(v, v), d = dot(u, w), e = dot(v, w), det = a * c - b * b;
  const auto at = [&](const Wide& x, const Wide& y) {
    const Vec gap = along(p, u, x) - along(r, v, y);
    return dot(gap, gap);
  };
  Wide best = at(0, 0);
  for (const int end : {0, 1}) {
    const Wide y = c > 0 ? clamped((e + b * end) / c) : Wide(0), x = a > 0 ? clamped((b * end - d) / a) : Wide(0);
    best = std::min({best, at(end, y), at(x, end)});
  }
  if (det > 0) {
    const Wide x = (b * e - c * d) / det, y = (a * e - b * d) / det;
    if (x >= 0 && x <= 1 && y >= 0 && y <= 1) best = std::min(best, at(x, y));
  }
  return best;
}

using WideTriangle = std::array<Vec, 3>;

bool holds(const WideTriangle& t, const Vec& normal, const Vec& point) {
  for (std::size_t i = 0; i < 3; ++i)
    if (dot(cross(t[(i + 1) % 3] - t[i], point - t[i]), normal) < 0) return false;
  return true;
}

Wide of_triangles(const TriangleInDouble& one, const TriangleInDouble& two) {
  WideTriangle t[2];
  for (std::size_t i = 0; i < 3; ++i) t[0][i] = widened(one[i]), t[1][i] = widened(two[i]);
  Wide best = of_segments(t[0][0], t[0][1], t[1][0], t[1][1]);
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      best = std::min(best, of_segments(t[0][i], t[0][(i + 1) % 3], t[1][k], t[1][(k + 1) % 3]));
  for (const int of : {0, 1}) {
    const WideTriangle &face = t[of], &other = t[1 - of];
    const Vec n = cross(face[1] - face[0], face[2] - face[0]);
    const Wide n2 = dot(n, n);
    if (n2 == 0) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      const Wide from = dot(n, other[i] - face[0]), to = dot(n, other[(i + 1) % 3] - face[0]);
      if (holds(face, n, other[i])) best = std::min(best, Wide(from * from / n2));
      if (from == to || (from > 0) == (to > 0)) continue;
      if (holds(face, n, along(other[i], other[(i + 1) % 3] - other[i], from / (from - to)))) best = 0;
    }
  }
  return sqrt(best);
}

class TriangleDistance : public testing::Test {
 protected:
  double uniform() { return std::uniform_real_distribution<double>(-1, 1)(random_); }
  glm::dvec3 point(double size = 1) { return size * glm::dvec3(uniform(), uniform(), uniform()); }
  /// A triangle of any shape: wide, thin, a segment, or a point.
  TriangleInDouble triangle(int shape) {
    const glm::dvec3 a = point(), b = point();
    const double thin = std::pow(10.0, -16 * std::abs(uniform()));
    if (shape == 0) return {a, b, point()};
    if (shape == 1) return {a, b, 0.5 * (a + b) + point(thin)};
    if (shape == 2) return {a, a + point(thin), b};
    return {a, shape == 3 ? b : a, shape == 3 ? 0.25 * a + 0.75 * b : a};
  }
  /// Compares distances, and the points that are told, with the truth. Returns the error in units of M.
  double error_of(const TriangleInDouble& a, const TriangleInDouble& b) {
    const TriangleGap gap = triangle_distance(a, b);
    double most = 0;
    for (const glm::dvec3& p : a)
      for (const TriangleInDouble* t : {&a, &b})
        for (const glm::dvec3& q : *t) most = std::max(most, glm::length(p - q));
    const TriangleGap back = triangle_distance(b, a);
    EXPECT_NEAR(gap.distance, back.distance, 0x1p-50 * most);
    if (most == 0) return gap.distance;
    const double apart = std::abs(glm::length(gap.a - gap.b) - gap.distance);
    EXPECT_LE(apart, 0x1p-22 * most + 0x1p-50);  // and the rounding of coordinates
    return double(abs(Wide(gap.distance) - of_triangles(a, b))) / most;
  }
  std::mt19937 random_{5};
};

TEST_F(TriangleDistance, IsThatOfQuadruplePrecision) {
  double worst = 0;
  for (int i = 0; i < 6000; ++i) {
    const TriangleInDouble a = triangle(i % 5);
    TriangleInDouble b = triangle(i / 5 % 5);
    const double near = std::pow(10.0, -18 * std::abs(uniform()));
    if (i % 3 == 0)  // beside or through the other one
      for (glm::dvec3& v : b) v = a[std::size_t(i) % 3] + near * v;
    if (i % 3 == 1) b[0] = a[1], b[1] = a[2] + point(near);  // along its edge
    worst = std::max(worst, error_of(a, b));
  }
  EXPECT_LE(worst, 0x1p-50) << worst * 0x1p53 << " * 2^-53";
  RecordProperty("worst", std::to_string(worst * 0x1p53));
}

TEST_F(TriangleDistance, OfKnownPairs) {
  const TriangleInDouble flat{glm::dvec3(0), {1, 0, 0}, {0, 1, 0}};
  const auto moved = [&](const glm::dvec3& by) {
    TriangleInDouble t = flat;
    for (glm::dvec3& v : t) v += by;
    return t;
  };
  EXPECT_EQ(triangle_distance(flat, flat).distance, 0);
  EXPECT_EQ(triangle_distance(flat, moved({0.25, 0.25, 3})).distance, 3);
  EXPECT_EQ(triangle_distance(flat, moved({5, 0, 0})).distance, 4);
  const TriangleInDouble upright{glm::dvec3(0.2, 0.2, -1), {0.2, 0.2, 1}, {0.3, 0.3, 1}};
  const TriangleGap through = triangle_distance(flat, upright);
  EXPECT_EQ(through.distance, 0);
  EXPECT_LT(glm::length(through.a - glm::dvec3(0.2, 0.2, 0)), 0.2);
  const TriangleGap corner = triangle_distance(flat, moved({2, 0, 0}));
  EXPECT_EQ(corner.a, glm::dvec3(1, 0, 0));
  EXPECT_EQ(corner.b, glm::dvec3(2, 0, 0));
}

}  // namespace
}  // namespace ballot
