// The exact answers of point queries, by arithmetic without rounding over all triangles. For tests and small meshes.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "engine/oracle/predicates.h"
#include "shaders/shared/query.h"

namespace ballot {

/// An exact squared distance, as a fraction whose lower part is positive.
struct ExactDistance {
  Dyadic above, below;
  /// Returns the distance, right to the last bits of a double.
  double distance() const;
  friend std::strong_ordering operator<=>(const ExactDistance& a, const ExactDistance& b) {
    return a.above * b.below <=> b.above * a.below;
  }
  friend bool operator==(const ExactDistance& a, const ExactDistance& b) { return (a <=> b) == 0; }
};

/// Returns the squared distance between a point and a triangle, which may have no area. Both must be finite.
ExactDistance exact_distance(const glm::vec3& point, const Triangle& triangle);

/// Returns the part of a triangle that is nearest to a point, without rounding: a corner (0, 1, 2), an edge (PART_EDGE
/// and on), or the inside (PART_INSIDE). A point that is nearest to an end of an edge is nearest to that corner. Both
/// must be finite.
std::uint32_t exact_part(const glm::vec3& point, const Triangle& triangle);

/// Returns whether a point is behind a triangle at the part that is nearest to it: whether N . (P - C) < 0, with P the
/// point, C the nearest point of that part, and N the normal of the triangle for its inside, else the pseudonormal of
/// the part, whose float32 numbers are taken as they are. Decided in double precision by a proved bound, else without
/// rounding.
bool exact_behind(const glm::vec3& point, const Triangle& triangle, std::uint32_t part,
                  std::span<const glm::vec3, PSEUDONORMALS> pseudonormals);

/// Returns whether the line of a ray crosses a triangle, by the rule of shaders/query/crossings.comp for ties, without
/// rounding: an origin whose line meets an edge is moved by infinitesimal steps along the two axes that follow the
/// ray's main axis, first that which follows at once. `sight` is of the ray and the triangle.
bool exact_crosses(const Ray& ray, const Triangle& triangle, const ExactSight& sight);

/// Returns whether the ray from a point along +x crosses a triangle, by the rule of exact_inside() for ties.
bool exact_crosses_ahead(const glm::vec3& point, const Triangle& triangle);

/// Returns whether a point is inside of the triangles: whether a ray from it along +x crosses them an odd number of
/// times, by the rule of shaders/query/inside.comp for ties, without rounding. A point on the surface gets the answer
/// of the point that lies an infinitesimal step (dx, dy, dz), dx >> dy >> dz > 0, beside it. Triangles without area
/// are left out.
bool exact_inside(const glm::vec3& point, std::span<const Triangle> triangles);

}  // namespace ballot
