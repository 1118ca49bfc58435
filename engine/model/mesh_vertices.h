// Vertices of a mesh in memory: checked, and written out as triangles. No Vulkan.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "engine/core/error.h"
#include "engine/core/geometry.h"

namespace ballot {

/// Throws Error(Arguments), which begins with `where` and names the vertex, if a coordinate is not finite or beyond
/// +-1e12. The first vertex has the number `first`. Uses all cores.
void check_vertices(std::span<const glm::vec3> vertices, const std::string& where, std::size_t first = 0);

/// Throws Error(Arguments), which begins with `where` and names the index, if one is of no vertex. The first index has
/// the number `first`.
template <class Index>
void check_indices(std::span<const Index> indices, std::size_t vertices, const std::string& where,
                   std::size_t first = 0) {
  for (std::size_t i = 0; i < indices.size(); ++i)
    if (indices[i] >= vertices)
      fail(Failure::Arguments, "{}: index {} is {}, but there are {} vertices", where, first + i, indices[i], vertices);
}

/// Writes three vectors for each triangle: those that `corners` number, or without corners vectors 0 1 2, 3 4 5, ...
/// Uses all cores.
void expand(std::span<const std::uint32_t> corners, std::span<const glm::vec3> vectors, std::span<Triangle> to);

}  // namespace ballot
