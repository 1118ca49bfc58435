// Vertices of a mesh in memory: checked, and written out as triangles. No Vulkan.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "engine/core/geometry.h"

namespace ballot {

/// Throws Error(Arguments), which begins with `where` and names the vertex, if a coordinate is not finite or beyond
/// +-1e12. The first vertex has the number `first`. Uses all cores.
void check_vertices(std::span<const glm::vec3> vertices, const std::string& where, std::size_t first = 0);

/// Writes three vectors for each triangle: those that `corners` number, or without corners vectors 0 1 2, 3 4 5, ...
/// Uses all cores.
void expand(std::span<const std::uint32_t> corners, std::span<const glm::vec3> vectors, std::span<Triangle> to);

}  // namespace ballot
