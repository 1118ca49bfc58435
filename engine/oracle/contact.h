// What a ray from a surface should meet first, and whether the offset of its origin loses that. Double precision on the
// CPU, for tests and tools.
#pragma once

#include "engine/formats/pair.h"
#include "engine/scene/scene.h"

namespace ballot {

/// A ray that started at a triangle.
struct Departure {
  Ray primary;  // the ray that found the triangle
  Hit hit;      // what it found
  Ray ray;      // the ray from there, origin offset
};

/// Where the primary ray meets the triangle, scene units, to double precision: on the exact ray, if that meets the
/// triangle; else, where only rounding made it a hit, by the weights of the hit.
glm::dvec3 surface_point(const Departure& departure, const Triangle& triangle);

/// Whether the offset of the origin loses the ray's first contact.
///
/// The ideal ray starts at surface_point() and has the ray's direction and t_max. Its first contact is its nearest hit
/// at t > 0 of any triangle but the one that it starts from; a contact nearer than 2^-40 of the coordinates, which
/// double precision cannot tell from the surface, is passed over. The contact is lost if the ray meets its plane before
/// the ray begins: the origin lies beyond it, or t_min does. A contact that the ray misses sideways, or meets later
/// behind something else, is not lost. The tree must hold the triangle under its prim. Thread-safe.
bool loses_contact(const PairTree& bvh, const Departure& departure, const Triangle& triangle);

}  // namespace ballot
