// Finds the first surface that a secondary ray should meet, and tells whether the offset of its origin loses it. Runs
// in double precision on the CPU, for tests and tools.
#pragma once

#include "engine/core/geometry.h"
#include "engine/tree/formats/pair.h"

namespace ballot {

/// A secondary ray that starts at a triangle.
struct Departure {
  Ray primary;  // the ray that found the triangle
  Hit hit;      // what it found
  Ray ray;      // the secondary ray, with its origin offset
};

/// Returns the point where the primary ray meets the triangle, in scene units and double precision. The point lies on
/// the exact ray if that meets the triangle. Where only rounding made it a hit, the point comes from the barycentric
/// coordinates of the hit.
glm::dvec3 surface_point(const Departure& departure, const Triangle& triangle);

/// True if the offset of the origin loses the secondary ray's first contact.
///
/// The ideal ray starts at surface_point() and has the secondary ray's direction and t_max. Its first contact is its
/// nearest hit at t > 0 of any triangle but the one that it starts from. A contact nearer than 2^-40 of the coordinates
/// is skipped, as double precision cannot tell it from the surface. The contact is lost if the secondary ray meets the
/// contact's plane before the ray begins, that is, if its origin or its t_min lies beyond the plane. A contact is not
/// lost if the secondary ray passes beside it, or meets it later behind something else. The tree must hold the triangle
/// under its prim. Thread-safe.
bool loses_contact(const PairTree& bvh, const Departure& departure, const Triangle& triangle);

}  // namespace ballot
