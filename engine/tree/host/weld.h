// Vertices and edges of triangles that are the same because their coordinates are equal. Internal to engine/tree/host.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "engine/core/parallel.h"

namespace ballot {

/// The bits of a vertex, with -0 as 0.
using VertexKey = std::array<std::uint32_t, 3>;
inline VertexKey key_of(const glm::vec3& v) {
  return {std::bit_cast<std::uint32_t>(v.x + 0.0f), std::bit_cast<std::uint32_t>(v.y + 0.0f),
          std::bit_cast<std::uint32_t>(v.z + 0.0f)};
}
inline glm::vec3 vertex_of(const VertexKey& k) {
  return {std::bit_cast<float>(k[0]), std::bit_cast<float>(k[1]), std::bit_cast<float>(k[2])};
}

/// An edge of one triangle, from its smaller end; `back`: the triangle runs along it the other way.
struct HalfEdge {
  VertexKey from, to;
  std::uint32_t prim;
  bool back;
  std::uint8_t number;  // from corner `number` to the next one
  static HalfEdge of(const VertexKey& a, const VertexKey& b, std::uint32_t prim, std::size_t number) {
    const auto n = std::uint8_t(number);
    return b < a ? HalfEdge{b, a, prim, true, n} : HalfEdge{a, b, prim, false, n};
  }
  bool is_same(const HalfEdge& other) const { return from == other.from && to == other.to; }
  friend bool operator<(const HalfEdge& a, const HalfEdge& b) {
    if (a.from != b.from) return a.from < b.from;
    if (a.to != b.to) return a.to < b.to;
    return a.prim < b.prim;
  }
};

/// Sorts by parts, several at a time, which are then merged.
template <class T>
void sort_on_all_cores(std::vector<T>& all) {
  const std::size_t part = std::max<std::size_t>(1 << 14, (all.size() + core_count() - 1) / core_count());
  for_chunks(all.size(), part, [&](std::size_t begin, std::size_t end) {
    std::sort(all.begin() + std::ptrdiff_t(begin), all.begin() + std::ptrdiff_t(end));
  });
  for (std::size_t end = part; end < all.size(); end += part)
    std::inplace_merge(all.begin(), all.begin() + std::ptrdiff_t(end),
                       all.begin() + std::ptrdiff_t(std::min(end + part, all.size())));
}

/// Calls visit(begin, end) for each run of equal entries of a sorted array: entry `begin` is the same as each up to
/// `end`.
template <class T, class Visit>
void for_equal(const std::vector<T>& sorted, const Visit& visit) {
  for (std::size_t begin = 0, end = 0; begin < sorted.size(); begin = end) {
    while (end < sorted.size() && sorted[end].is_same(sorted[begin])) ++end;
    visit(begin, end);
  }
}

}  // namespace ballot
