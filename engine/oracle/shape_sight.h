// The exact oracle's part about shapes other than triangles: where a ray meets them, without rounding.
//
// Definition. The float32 values of a shape (engine/model/shapes.h) are taken as real numbers. The line of a ray has a
// closed span with a sphere, a capsule (the convex hull of two spheres) or a box, surface included, and counts both of
// its ends as hits, a point that it only touches as both. A disc is the part of the plane through its centre, at right
// angles to its normal, that is not farther from the centre than the radius; a line in that plane misses it. What
// nothing meets (is_nothing()) is missed. Of the hits in [t_min, t_max], exactly, the nearest has the smallest exact
// t, and the smallest number among exactly equal t.
//
// Method. Signs are decided in double with a bound of each number's error (bounded.h), the others in integers
// (dyadic.h): those of polynomials, and of sums of two square roots by squaring.
#pragma once

#include <compare>
#include <glm/vec2.hpp>
#include <memory>
#include <optional>

#include "engine/oracle/filter.h"
#include "engine/oracle/oracle_scene.h"
#include "engine/oracle/shape_roots.h"

namespace ballot {

/// A shape as a ray sees it. Keeps references to both.
class ShapeSight {
 public:
  /// The shape is not of triangles. The ray is not dead.
  ShapeSight(const Ray& ray, ShapeKind kind, const Shape& shape);

  /// Returns true if the line of the ray meets the shape. The rest is about one that it meets.
  bool meets();
  /// Returns the number of hits: 1 of a disc, else 2.
  int ends() const { return kind_ == ShapeKind::Discs ? 1 : 2; }
  /// Returns numbers that hold the exact t of an end: 0 where the line enters, 1 where it leaves.
  const Interval& t(int end) const { return t_[end]; }
  bool within(int end);  // t_min <= t <= t_max
  static std::strong_ordering compare_t(ShapeSight& a, int end, ShapeSight& b, int other);
  /// Returns t: one that rounds to float32 as the exact t does, and is within 2^-24 of it relative to it.
  double number(int end);
  /// Returns the outward normal at an end, of any length: of a disc its own. In double, of the point at number().
  glm::dvec3 normal(int end);

 private:
  const ShapeEnds<Dyadic>& exact();

  const Ray* ray_;
  ShapeKind kind_;
  const Shape* shape_;
  std::optional<bool> met_;  // none: not decided yet
  ShapeEnds<Bounded> ends_;
  bool has_ends_ = false;  // ends_ are known
  Interval t_[2];
  std::unique_ptr<ShapeEnds<Dyadic>> exact_;
};

/// Returns u and v of a hit with an outward normal (shaders/lib/shape/shapes.glsl).
glm::dvec2 octahedral_of(const glm::dvec3& normal);

/// Returns the nearest hit of a ray in a mesh of shapes, or of its shape `prim` alone.
OracleHit nearest_shape(const PlacedMesh& mesh, std::optional<std::uint32_t> prim = {});

}  // namespace ballot
