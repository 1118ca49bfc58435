// The exact oracle of all crossings: finds every triangle that a ray crosses, and whether a point is inside, without
// rounding, over the arrays that are uploaded to the device.
//
// Definition. The line of a ray crosses a triangle by exact_crosses() (nearest.h): ties at edges and vertices are
// broken by infinitesimal steps of the origin, the same for all triangles. The crossing counts if t_min <= t <= t_max
// exactly. Crossings are in the order of the exact t, at equal t in that of prim. Among instances they are defined by
// shaders/lib/tree/instances.glsl: those of one are in this order, those of two in the order of t in float32, at equal
// t in that of prim.
//
// Method: that of exact.h. The filter decides what its bound allows (filter.h), integers decide the rest.
#pragma once

#include <functional>
#include <vector>

#include "engine/oracle/oracle_scene.h"

namespace ballot {

/// A crossing. t, u and v are within 2^-30 of the exact numbers, relative to these or, u and v, to 1.
using ExactCrossing = OracleHit;

/// Tells whether a crossing is wanted: of which triangle, and from its front (the side from which its vertices run
/// counter-clockwise).
using KeepCrossing = std::function<bool(std::uint32_t prim, bool front)>;

/// The exact oracle of all crossings of a scene. Thread-safe.
class ExactCrossings {
 public:
  explicit ExactCrossings(OracleScene scene) : scene_(std::move(scene)) {}

  /// Returns the crossings of a ray. A dead ray has none.
  std::vector<ExactCrossing> list(const Ray& ray, const KeepCrossing& keep = {}) const;

  /// Puts crossings that are known to be all of a ray into order, and finds their numbers. The scene must have its
  /// triangles. `prims` may come in any order.
  std::vector<ExactCrossing> in_order(const Ray& ray, std::vector<std::uint32_t> prims) const;

  /// Returns whether a point is inside: whether the ray from it along +x crosses an odd number of triangles, by the
  /// rule of exact_inside(). Among instances it is so of an odd number of them, by shaders/lib/query/
  /// inside_instances.glsl. A dead point is outside.
  bool inside(const glm::vec3& point) const;

 private:
  OracleScene scene_;
};

}  // namespace ballot
