// The triangles of instances as queries of points see them: their corners moved to the world.
#pragma once

#include <vector>

#include "engine/tree/host/forest.h"

namespace ballot {

/// Returns a vertex of a mesh where an instance has it in the world. Every operation is rounded to float32 in a fixed
/// order, which kernels repeat (shaders/lib/query/point_instances.glsl).
inline glm::vec3 moved_corner(const Transform& t, const glm::vec3& v) {
  glm::vec3 to;
  for (int r = 0; r < 3; ++r) {
    const float x = t.m[r][0] * v.x, y = t.m[r][1] * v.y, z = t.m[r][2] * v.z;
    const float plane = x + y, turned = plane + z;
    to[r] = turned + t.m[r][3];
  }
  return to;
}
inline Triangle moved_corners(const Transform& t, const Triangle& triangle) {
  return {moved_corner(t, triangle[0]), moved_corner(t, triangle[1]), moved_corner(t, triangle[2])};
}

/// The same of a triangle by its number, which is counted through the instances.
Triangle moved_triangle(const Forest& forest, std::uint32_t prim);

/// Returns all triangles in the order of their numbers. One that has no area in its mesh is a point. Throws Error(Work)
/// if there is no memory for them. Uses all cores.
UnsetVector<Triangle> moved_triangles(const Forest& forest);

}  // namespace ballot
