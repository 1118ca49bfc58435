// Triangles and boxes with sides along the axes that have a point in common, decided without rounding.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/core/geometry.h"
#include "engine/oracle/oracle_scene.h"

namespace ballot {

/// Returns true if a closed triangle and a closed box have a point in common. All coordinates must be finite.
bool overlap(const Triangle& triangle, const Bounds& box);

/// Returns the triangles of a scene that overlap a box, ascending: their corners are those of the world
/// (engine/tree/host/moved_corners.h). A triangle that lies in several leaves is there once. A box that is not finite,
/// or whose low corner is above its high corner, overlaps nothing. Thread-safe.
std::vector<std::uint32_t> prims_overlapping(const OracleScene& scene, const Bounds& box);

}  // namespace ballot
