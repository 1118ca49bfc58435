// Cuts polygons into triangles. Internal to engine/scene.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace ballot {

/// Appends n - 2 triangles as indices into `polygon`, which has n >= 3 corners. A convex polygon becomes a fan around
/// its first corner. A polygon that is not convex is cut by ear clipping in its projection, or as a fan if it has very
/// many corners. For a polygon that is not simple the triangles are arbitrary.
void triangulate(std::span<const glm::vec3> polygon, std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace ballot
