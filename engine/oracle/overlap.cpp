// The axes are those of shaders/lib/query/overlap.glsl. A sign is decided in double precision if it is above a bound of
// its rounding error. With u = 2^-53, a product of two differences of float32 numbers is off by 3 u of itself, and a
// difference of two such products by 4 u of their sizes: 16 u are taken. A sum that is 0 is exact, as no product
// underflows. In between integers decide.
#include "engine/oracle/overlap.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include "engine/oracle/dyadic.h"
#include "engine/oracle/predicates.h"

namespace ballot {

namespace {

constexpr double kRoom = 0x1p-49;

int sign_of(double x) { return (x > 0) - (x < 0); }

/// A difference of two coordinates.
struct Gap {
  float from, to;
  double rounded() const { return double(to) - double(from); }
  Dyadic exact() const { return Dyadic(to) - Dyadic(from); }
};

/// Returns the sign of a b - c d.
int sign_of(const Gap& a, const Gap& b, const Gap& c, const Gap& d) {
  const double p = a.rounded() * b.rounded(), q = c.rounded() * d.rounded(), size = std::abs(p) + std::abs(q);
  if (std::abs(p - q) > kRoom * size || size == 0) return sign_of(p - q);
  return (a.exact() * b.exact() - c.exact() * d.exact()).sign();
}

glm::vec3 corner_of(const Bounds& box, int i) {
  return {i & 1 ? box.hi.x : box.lo.x, i & 2 ? box.hi.y : box.lo.y, i & 4 ? box.hi.z : box.lo.z};
}

bool apart_along_normal(const Triangle& t, const Bounds& box) {
  const int first = volume_sign(t[0], t[1], t[2], box.lo);
  if (first == 0) return false;
  for (int i = 1; i < 8; ++i)
    if (volume_sign(t[0], t[1], t[2], corner_of(box, i)) != first) return false;
  return true;
}

/// Returns true if the projections on the product of the axis k and the edge from p to q are apart: if all corners of
/// the box lie on one side of the edge, and of the line beside it through the third corner.
bool apart_along_edge(const glm::vec3& p, const glm::vec3& q, const glm::vec3& third, const Bounds& box, int k) {
  const int i = (k + 1) % 3, j = (k + 2) % 3;
  const auto side = [&](const glm::vec3& from, int corner) {
    const float x = corner & 1 ? box.hi[i] : box.lo[i], y = corner & 2 ? box.hi[j] : box.lo[j];
    return sign_of({p[i], q[i]}, {from[j], y}, {p[j], q[j]}, {from[i], x});
  };
  const int first = side(p, 0);
  if (first == 0) return false;
  for (int corner = 0; corner < 4; ++corner)
    if ((corner && side(p, corner) != first) || side(third, corner) != first) return false;
  return true;
}

}  // namespace

bool overlap(const Triangle& t, const Bounds& box) {
  const glm::vec3 lo = glm::min(glm::min(t[0], t[1]), t[2]), hi = glm::max(glm::max(t[0], t[1]), t[2]);
  if (glm::any(glm::lessThan(hi, box.lo)) || glm::any(glm::greaterThan(lo, box.hi))) return false;
  if (apart_along_normal(t, box)) return false;
  for (std::size_t edge = 0; edge < 3; ++edge)
    for (int k = 0; k < 3; ++k)
      if (apart_along_edge(t[edge], t[(edge + 1) % 3], t[(edge + 2) % 3], box, k)) return false;
  return true;
}

std::vector<std::uint32_t> prims_overlapping(const OracleScene& scene, const Bounds& box) {
  std::vector<std::uint32_t> found;
  for (int k = 0; k < 3; ++k)
    if (!std::isfinite(box.lo[k]) || !std::isfinite(box.hi[k]) || box.lo[k] > box.hi[k]) return found;
  const glm::dvec3 middle = 0.5 * (glm::dvec3(box.lo) + glm::dvec3(box.hi)), half = glm::dvec3(box.hi) - middle;
  const double far = glm::dot(half, half) * (1 + 0x1p-40) + 0x1p-290;
  scene.for_each_near(middle, far, [&](std::uint32_t prim, const Triangle& triangle) {
    if (overlap(triangle, box)) found.push_back(prim);
  });
  std::ranges::sort(found);
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

}  // namespace ballot
