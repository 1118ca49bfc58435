// The oracle of numeric mode "double": what rays and points in double find among triangles in double, by the arithmetic
// of shaders/lib/numeric/triangle_double.glsl, whose bits it has. A single tree alone, no instances.
//
// The crossings of a ray are those of shaders/lib/query/triangle_crossing.glsl in double: ties are broken by an
// infinitesimal step, so a closed surface is crossed an even number of times. They answer what lists crossings or
// leaves triangles out, and the inside test.
#pragma once

#include <functional>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "engine/model/hit_geometry.h"
#include "engine/oracle/oracle_scene.h"
#include "engine/tree/host/corners_in_double.h"

namespace ballot {

/// Where a ray meets the plane of a triangle: t, the weights of vertices 1 and 2, the signs of the edge functions.
struct SightInDouble {
  double t = 0, u = 0, v = 0;
  bool meets = false;    // the closed triangle
  bool crosses = false;  // by the rule for ties
  bool front = false;    // the ray comes from the side from which the vertices run counter-clockwise
};
/// The ray must not be dead.
SightInDouble sight_in_double(const RayInDouble& ray, const CornersInDouble& corners);

struct CrossingInDouble {
  double t = 0;
  std::uint32_t prim = NO_HIT;
  double u = 0, v = 0;
};
struct ClosestInDouble {
  double distance = 0;
  std::uint32_t prim = NO_HIT;
  glm::dvec3 at{0};
  double u = 0, v = 0;
};

/// Answers in double on the host. Thread-safe.
class OracleInDouble {
 public:
  /// Keeps references. `corners`: of all triangles; none: those of float32.
  OracleInDouble(const PairTree& tree, std::span<const Triangle> triangles, std::span<const CornersInDouble> corners);

  CornersInDouble corners(std::uint32_t prim) const;

  /// Returns the nearest hit: of the smallest t in double, at equal t of the smallest prim.
  OracleHit nearest(const RayInDouble& ray) const;
  /// The same by tests of every triangle.
  OracleHit brute_force(const RayInDouble& ray) const;

  using Keep = std::function<bool(std::uint32_t prim, bool front)>;
  /// Returns the first `most` crossings in order of t, at equal t of prim. `last`: those of the largest t instead, the
  /// farthest first. Triangles that `keep` refuses are left out.
  std::vector<CrossingInDouble> list(const RayInDouble& ray, const Keep& keep = {}, std::size_t most = ~std::size_t{0},
                                     bool last = false) const;

  /// Returns the nearest point of the nearest triangle within `limit`, at equal distance of the smallest prim: within
  /// 2^-46 of the largest distance of the triangle's vertices. prim NO_HIT: there is none.
  ClosestInDouble closest(const glm::dvec3& point, double limit,
                          const std::function<bool(std::uint32_t prim)>& keep = {}) const;
  /// Returns whether a ray from the point crosses an odd number of triangles.
  bool inside(const glm::dvec3& point) const;

 private:
  const PairTree& tree_;
  std::span<const Triangle> triangles_;
  std::span<const CornersInDouble> corners_;
  double largest_ = 0;  // coordinate of a vertex that float32 rounds
};

}  // namespace ballot
