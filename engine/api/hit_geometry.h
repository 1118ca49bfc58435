// Where hits are, and from which side rays meet what they hit, with the bits of shaders/query/columns.comp.
#pragma once

#include <glm/geometric.hpp>

#include "engine/core/geometry.h"
#include "engine/core/unit_normal.h"
#include "shaders/shared/layout.h"

namespace ballot::api {

/// Returns the point of a triangle that the weights of its vertices 1 and 2 name. Zeros have no sign.
inline glm::vec3 position_of(const Triangle& t, float u, float v) {
  const glm::dvec3 a(t[0]), b(t[1]), c(t[2]);
  return glm::vec3(a + (double(u) * (b - a) + double(v) * (c - a))) + 0.f;
}

/// Returns the point of a ray at t. Zeros have no sign.
inline glm::vec3 position_along(const Ray& ray, float t) {
  return glm::vec3(glm::dvec3(ray.origin) + double(t) * glm::dvec3(ray.dir)) + 0.f;
}

/// Returns whether a ray comes from where a normal of any length points to.
inline bool is_front(const glm::dvec3& normal, const Ray& ray) {
  return normal.x * double(ray.dir.x) + normal.y * double(ray.dir.y) + normal.z * double(ray.dir.z) < 0;
}

}  // namespace ballot::api
