#include "engine/model/mesh_vertices.h"

#include <cmath>

#include "engine/core/parallel.h"

namespace ballot {

void check_vertices(std::span<const glm::vec3> vertices, const std::string& where, std::size_t first) {
  constexpr float kLargest = 1e12f;                                       // the limit of build_bvh()
  const auto in_range = [](float x) { return std::abs(x) <= kLargest; };  // false for NaN
  for_chunks(vertices.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      if (const glm::vec3& v = vertices[i]; !in_range(v.x) || !in_range(v.y) || !in_range(v.z))
        fail(Failure::Arguments,
             "{}: vertex {} is ({}, {}, {}); expected finite numbers within +-1e12; scale the scene", where, first + i,
             v.x, v.y, v.z);
  });
}

void expand(std::span<const std::uint32_t> corners, std::span<const glm::vec3> vectors, std::span<Triangle> to) {
  for_chunks(to.size(), 1 << 15, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t)
      for (std::size_t k = 0; k < 3; ++k) to[t][k] = vectors[corners.empty() ? 3 * t + k : corners[3 * t + k]];
  });
}

}  // namespace ballot
