#include "engine/oracle/predicates.h"

#include <algorithm>

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
