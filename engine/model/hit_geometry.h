// Where hits are, and from which side rays meet what they hit, with the bits of shaders/query/columns.comp.
#pragma once

#include <algorithm>
#include <glm/geometric.hpp>

#include "engine/core/geometry.h"
#include "engine/core/unit_normal.h"
#include "engine/model/recentring.h"
#include "shaders/shared/layout.h"

namespace ballot {

/// Returns the point of a triangle that the weights of its vertices 1 and 2 name.
template <class Corners>
glm::dvec3 position_of(const Corners& t, float u, float v) {
  const glm::dvec3 a(t[0]), b(t[1]), c(t[2]);
  return a + (double(u) * (b - a) + double(v) * (c - a));
}

/// Returns the point of a ray at t.
inline glm::dvec3 position_along(const Ray& ray, float t) {
  return glm::dvec3(ray.origin) + double(t) * glm::dvec3(ray.dir);
}

/// Returns a position as float32, where zeros have no sign.
inline glm::vec3 rounded(const glm::dvec3& position) { return glm::vec3(position) + 0.f; }

/// Returns t in double where a ray meets the plane of a triangle, both about one origin, between those of the
/// triangle's nearest and farthest vertex. `t`: where it lies in the plane.
template <class Corners>
double t_of(const RayInDouble& ray, const Corners& triangle, double t) {
  const glm::dvec3 a(triangle[0]), b(triangle[1]), c(triangle[2]), normal = glm::cross(b - a, c - a);
  if (const double along = glm::dot(normal, ray.dir); along != 0) t = glm::dot(normal, a - ray.origin) / along;
  const double length = glm::dot(ray.dir, ray.dir);
  const auto at = [&](const glm::dvec3& v) { return glm::dot(v - ray.origin, ray.dir) / length; };
  const auto [low, high] = std::minmax({at(a), at(b), at(c)});
  return std::clamp(t, low, high);
}

/// Returns whether a ray comes from where a normal of any length points to.
inline bool is_front(const glm::dvec3& normal, const Ray& ray) {
  return normal.x * double(ray.dir.x) + normal.y * double(ray.dir.y) + normal.z * double(ray.dir.z) < 0;
}

}  // namespace ballot
