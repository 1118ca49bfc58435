#include "engine/oracle/predicates.h"

#include <algorithm>
#include <cmath>

namespace ballot {

ExactSight::ExactSight(const RayInDouble& ray, const Triangle& triangle) {
  const DyadicVec p[3] = {difference(triangle[0], ray.origin), difference(triangle[1], ray.origin),
                          difference(triangle[2], ray.origin)};
  const DyadicVec d{Dyadic(ray.dir.x), Dyadic(ray.dir.y), Dyadic(ray.dir.z)};
  const DyadicVec across = cross(p[1], p[2]);
  side[0] = dot(d, across);
  side[1] = dot(d, cross(p[2], p[0]));
  side[2] = dot(d, cross(p[0], p[1]));
  det = side[0] + side[1] + side[2];
  depth = dot(p[0], across);
}

// The sign of the volume of four points, det [b - a, c - a, d - a], is decided in double precision if it is above a
// bound of its rounding error. With u = 2^-53, each of its six products is off by 3 u of itself (its factors), 2 u (its
// two multiplications) and 3 u (the sums): by 8 u of the sum of their sizes in all, and 16 u are taken. If that sum is
// 0, so is each product, as none can underflow. In between integers decide.
int volume_sign(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d, bool* by_integers) {
  if (d == a || d == b || d == c) return 0;
  const glm::dvec3 from(a), x = glm::dvec3(b) - from, y = glm::dvec3(c) - from, z = glm::dvec3(d) - from;
  double volume = 0, size = 0;
  for (int i = 0; i < 3; ++i) {
    const double p = x[(i + 1) % 3] * y[(i + 2) % 3], q = x[(i + 2) % 3] * y[(i + 1) % 3];
    volume += z[i] * (p - q);
    size += std::abs(z[i]) * (std::abs(p) + std::abs(q));
  }
  if (std::abs(volume) > 0x1p-49 * size) return volume > 0 ? 1 : -1;
  if (size == 0) return 0;
  if (by_integers) *by_integers = true;
  return dot(difference(d, a), cross(difference(b, a), difference(c, a))).sign();
}

bool has_area(const Triangle& t) {
  const DyadicVec normal = cross(difference(t[1], t[0]), difference(t[2], t[0]));
  return normal[0].sign() != 0 || normal[1].sign() != 0 || normal[2].sign() != 0;
}

bool ExactSight::hits_line() const {
  const auto [least, most] = std::minmax({side[0].sign(), side[1].sign(), side[2].sign()});
  return least * most >= 0 && (least != 0 || most != 0);
}

bool ExactSight::within(const RayInDouble& ray) const {
  // The sign of t - bound: sign((t - bound) * det) * sign(det).
  const auto above = [&](double bound) { return (depth - Dyadic(bound) * det).sign() * det.sign(); };
  return above(ray.t_min) >= 0 && above(ray.t_max) <= 0;
}

std::strong_ordering compare_t(const ExactSight& a, const ExactSight& b) {
  const int order = (a.depth * b.det - b.depth * a.det).sign();
  return order * a.det.sign() * b.det.sign() <=> 0;
}

double t_apart(const ExactSight& a, const ExactSight& b) {
  return quotient(b.depth * a.det - a.depth * b.det, a.det * b.det);
}

}  // namespace ballot
