// Instances: meshes that are moved by matrices. The map of a ray into a mesh's own space, and the box of an instance in
// the world.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "engine/model/placement.h"
#include "engine/model/recentring.h"
#include "engine/tree/host/bvh.h"

namespace ballot {

/// The map of rays into a mesh's space: a direction d becomes (dot(row[0], d), dot(row[1], d), dot(row[2], d)), an
/// origin o the same of o - translation. The rows are the inverse of the transform's matrix, computed in double
/// precision and rounded.
struct ObjectMap {
  glm::vec3 row[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  glm::vec3 translation{0};
};

/// Returns the scale by which a ray is walked: its direction times `inverse` has its largest component in [1, 2). A t
/// of the walk is a t of the ray divided by `inverse`. The ray must not be dead (shaders/lib/numeric/ray_scale.glsl).
float direction_scale(const Ray& ray);

/// Returns the ray of an instance: the ray in the mesh's space, whose hits are those of the instance. Its t counts
/// multiples of the given direction times direction_scale(). Every operation is rounded to float32 in a fixed order
/// (shaders/lib/tree/instances.glsl), so the device's kernels walk the very same ray.
Ray object_ray(const Ray& ray, const ObjectMap& map);
/// The same for mode "double", in double.
RayInDouble object_ray_in_double(const Ray& ray, const ObjectMap& map);

/// The facts of a mesh that boxes of its instances follow from.
struct MeshExtents {
  Bounds bounds;                  // of its tree; not used if it is empty
  glm::vec3 largest_triangle{0};  // the largest extent of a triangle along each axis
  bool empty = true;              // no triangle can be hit
};
MeshExtents extents_of(const Bvh& bvh, std::span<const Triangle> triangles);

/// An instance: where its mesh lies in the world.
struct Instance {
  std::uint32_t mesh = 0;
  std::uint32_t first = 0;  // number of its first triangle; instances number theirs one after the other
  ObjectMap map;
  bool mirrors = false;  // the matrix does
  Bounds box;            // of the moved mesh, widened by the part of the rounding errors that no ray adds to
  float slack = 0;       // times the distance of a ray's origin from the box: the rest of the errors
};

/// Places a mesh in the world. Throws Error(Arguments), which names the instance by its number, if an entry is not
/// finite, the largest magnitude of a column of the matrix is not between 2^-60 and 2^60, the matrix cannot be inverted
/// in float32 (it would multiply rounding errors by more than 2^20), or the moved mesh leaves +-1e12.
Instance place_instance(const MeshExtents& mesh, const Transform& transform, std::size_t number);

}  // namespace ballot
