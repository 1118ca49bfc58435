// Triangles in double.
#pragma once

#include <array>
#include <glm/vec3.hpp>

#include "engine/core/geometry.h"

namespace ballot {

using CornersInDouble = std::array<glm::dvec3, 3>;  // the vertices about the origin of their mesh, in scene units
static_assert(sizeof(CornersInDouble) == 72);

inline CornersInDouble widened(const Triangle& t) { return {glm::dvec3(t[0]), glm::dvec3(t[1]), glm::dvec3(t[2])}; }

/// A bound of how far float32 moves a number of this size, and the next larger float32 of its size: 2^-24 of it.
inline constexpr double kRoundedToSingle = 0x1p-24;

}  // namespace ballot
