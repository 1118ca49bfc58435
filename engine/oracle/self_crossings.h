// Triangles of a mesh that pass through each other, decided without rounding.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "engine/core/geometry.h"
#include "engine/tree/host/bvh.h"

namespace ballot {

/// The triangles that pass through another one of the mesh: an edge of one passes through the inside of the other.
/// Those that only touch, or overlap in a plane, do not.
struct SelfCrossings {
  std::vector<std::uint32_t> prims;                            // those that pass through another, ascending
  std::vector<std::pair<std::uint32_t, std::uint32_t>> first;  // at most ten pairs, in order
  std::uint64_t pairs = 0;                                     // that pass through each other
  bool whole = true;  // false: the search ended at one of its bounds, and there may be more of all these
};

/// The search ends once this many pairs have been found, of which one triangle has 2^14 at most. It also ends once it
/// has looked at some 2^26 pairs of triangles whose boxes meet, and 1024 more for each triangle. Where integers decide,
/// a pair counts 64 times or more.
inline constexpr std::uint64_t kMostCrossingPairs = 1 << 18;

/// Returns true if an edge of one triangle passes through the inside of the other, without rounding.
bool pass_through(const Triangle& a, const Triangle& b);

/// Finds the triangles that pass through each other, on all cores. The result does not depend on their number. Throws
/// as build_bvh() does, and what `progress` throws, which is called several times a second.
SelfCrossings self_crossings(std::span<const Triangle> triangles, const Progress& progress = {});

}  // namespace ballot
