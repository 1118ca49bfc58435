// Do the boxes of a triangle's leaves cover it? Internal to check_bvh.
#pragma once

#include <span>
#include <vector>

#include "engine/bvh/bvh.h"

namespace ballot {

constexpr std::uint32_t kNobody = 0xFFFFFFFFu;  // a reference that no leaf owns

/// The leaves that hold each triangle. `owner` names the leaf node of each reference, or kNobody.
class LeavesOfTriangles {
 public:
  LeavesOfTriangles(const Bvh& bvh, std::span<const std::uint32_t> owner, std::size_t triangle_count);
  std::span<const std::uint32_t> of(std::size_t prim) const;

 private:
  std::vector<std::uint32_t> begin_;  // one more than there are triangles
  std::vector<std::uint32_t> leaves_;
};

/// What of the triangle the boxes of these nodes do not cover ("vertex 2", "an edge", ...); null if nothing. The
/// vertices are compared exactly. Edges and medians are covered if the union of their parts in each box leaves no gap
/// beyond double precision's rounding. That is not every point, but a gap between two split boxes crosses an edge.
const char* uncovered(const Triangle& triangle, std::span<const std::uint32_t> leaves, std::span<const BvhNode> nodes);

}  // namespace ballot
