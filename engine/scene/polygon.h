// Polygons into triangles. Internal to engine/scene.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace ballot {

/// Appends n - 2 triangles, as places in `polygon` (n >= 3 corners). A convex polygon becomes a fan about its first
/// corner; another has its ears clipped, seen along its normal; one that is no simple polygon gets some triangles.
void triangulate(std::span<const glm::vec3> polygon, std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace ballot
