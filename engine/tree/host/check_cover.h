// Checks that the boxes of a triangle's leaves cover it. Internal to check_bvh.
#pragma once

#include <span>
#include <vector>

#include "engine/tree/host/bvh.h"

namespace ballot {

constexpr std::uint32_t kNobody = 0xFFFFFFFFu;  // the owner of a reference that no leaf holds

/// A table of the leaves that hold each triangle. `owner` gives the leaf node of each reference, or kNobody.
class LeavesOfTriangles {
 public:
  LeavesOfTriangles(const Bvh& bvh, std::span<const std::uint32_t> owner, std::size_t triangle_count);
  std::span<const std::uint32_t> of(std::size_t prim) const;

 private:
  std::vector<std::uint32_t> begin_;  // first entry of each triangle in leaves_; one more than there are triangles
  std::vector<std::uint32_t> leaves_;
};

/// Returns the first part of the triangle that the boxes of these nodes do not cover ("vertex 2", "an edge", ...), or
/// null if they cover it. Vertices are compared exactly. An edge or a median is covered if its parts in the boxes leave
/// no gap beyond the rounding error of double precision. This does not check every point of the triangle, but any gap
/// between two split boxes crosses an edge.
const char* uncovered(const Triangle& triangle, std::span<const std::uint32_t> leaves, std::span<const BvhNode> nodes);

}  // namespace ballot
