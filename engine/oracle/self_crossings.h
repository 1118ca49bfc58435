// Triangles of a mesh that pass through each other, decided without rounding.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "engine/bvh/bvh.h"
#include "engine/scene/scene.h"

namespace ballot {

/// The triangles that pass through another one of the mesh: an edge of one passes through the inside of the other.
/// Those that only touch, or overlap in a plane, do not.
struct SelfCrossings {
  std::vector<std::uint32_t> prims;                            // those that pass through another, ascending
  std::vector<std::pair<std::uint32_t, std::uint32_t>> first;  // at most ten pairs, in order
};

/// Returns true if an edge of one triangle passes through the inside of the other, without rounding.
bool pass_through(const Triangle& a, const Triangle& b);

/// Finds the triangles that pass through each other, on all cores. Throws as build_bvh() does.
SelfCrossings self_crossings(std::span<const Triangle> triangles, const Progress& progress = {});

}  // namespace ballot
