#include "engine/model/recentring.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace ballot {

namespace {

constexpr double kNear = 2;        // diagonals of the box
constexpr double kLargest = 1e30;  // beyond it no sum here leaves the range of double, and float32 holds it
constexpr float kNoBound = std::numeric_limits<float>::max();

double reach_of(const glm::dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

/// Where a line enters a box and leaves it; `leaves` below `enters`: it misses it.
struct Span {
  double enters = -std::numeric_limits<double>::infinity(), leaves = std::numeric_limits<double>::infinity();
};

Span meet(const glm::dvec3& origin, const glm::dvec3& dir, const glm::dvec3& lo, const glm::dvec3& hi) {
  Span span;
  for (int axis = 0; axis < 3; ++axis) {
    if (dir[axis] == 0) {
      if (origin[axis] < lo[axis] || origin[axis] > hi[axis]) return {0, -1};
      continue;
    }
    const double a = (lo[axis] - origin[axis]) / dir[axis], b = (hi[axis] - origin[axis]) / dir[axis];
    span.enters = std::max(span.enters, std::min(a, b));
    span.leaves = std::min(span.leaves, std::max(a, b));
  }
  return span;
}

/// Returns a bound of t, which stays finite unless it is no bound.
float bound(double t) { return t > double(kNoBound) ? kNoBound : float(t); }

}  // namespace

Recentring::Recentring(const glm::dvec3& origin, const Bounds& box)
    : origin_(origin), lo_(box.lo), hi_(box.hi), diagonal_(glm::length(hi_ - lo_)) {
  near_lo_ = lo_ - kNear * diagonal_;
  near_hi_ = hi_ + kNear * diagonal_;
}

bool Recentring::is_held(const glm::dvec3& v) { return reach_of(v) <= kLargest; }  // false for NaN

RayInDouble Recentring::about(const RayInDouble& given) const {
  return {given.origin - origin_, given.t_min, given.dir, std::min(given.t_max, double(kNoBound))};
}

Ray Recentring::ray(const RayInDouble& given, double& moved) const {
  moved = 0;
  const glm::dvec3 origin = given.origin - origin_;
  const Ray as_it_is{glm::vec3(origin), float(given.t_min), glm::vec3(given.dir), bound(given.t_max)};
  if (stays_ || is_near(given.origin) || !is_held(given.origin) || !std::isfinite(as_it_is.t_min)) return as_it_is;
  constexpr Ray kDead{glm::vec3(0), 0, glm::vec3(0), 0};
  const double margin = 0x1p-20 * diagonal_ + 0x1p-50 * reach_of(origin);
  const Span span = meet(origin, given.dir, lo_ - margin, hi_ + margin);
  const double from = std::max(span.enters, given.t_min);
  if (!(from <= span.leaves && from < given.t_max) || !std::isfinite(from)) return kDead;
  moved = from;
  return {glm::vec3(origin + from * given.dir), 0, as_it_is.dir, bound(given.t_max - from)};
}

glm::dvec3 origin_for(const glm::dvec3& lo, const glm::dvec3& hi) {
  const double side = std::max({hi.x - lo.x, hi.y - lo.y, hi.z - lo.z});
  if (!(std::max(reach_of(lo), reach_of(hi)) > 2 * side)) return glm::dvec3(0);
  const double step = side > 0 ? std::exp2(std::floor(std::log2(side)) - 2) : 0;
  const glm::dvec3 middle = lo / 2.0 + hi / 2.0;
  return step > 0 ? glm::round(middle / step) * step : middle;
}

}  // namespace ballot
