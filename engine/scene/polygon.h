// Cuts polygons into triangles. Internal to engine/scene.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace ballot {

/// Appends n - 2 triangles as indices into `polygon`, which has n >= 3 corners. Their areas add up to the polygon's, in
/// the projection along the largest axis of its normal. A convex polygon becomes a fan around its first corner, any
/// other is cut by ear clipping. Corners may repeat and lie on a line; edges may touch, and bridge to holes and back;
/// what has no area gets triangles without area. The work is about n log n, and bounded by a few thousand steps a
/// corner.
///
/// Returns false if the polygon is not simple: its edges cross, or it turns inside out. Then its triangles cover about
/// what it surrounds.
bool triangulate(std::span<const glm::vec3> polygon, std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace ballot
