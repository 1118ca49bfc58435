// The exact predicates: the numbers that decide about a ray and a triangle, without any rounding.
#pragma once

#include <compare>

#include "engine/core/geometry.h"
#include "engine/model/recentring.h"
#include "engine/oracle/dyadic.h"

namespace ballot {

/// The exact numbers of a ray o + t d and a triangle v0 v1 v2, with p_i = v_i - o.
///
/// side[0] = d . (p1 x p2), side[1] = d . (p2 x p0), side[2] = d . (p0 x p1) are six times the signed volumes that the
/// ray spans with the edges. But for its sign, a side depends on its edge alone, so neighbours agree on a shared edge.
///   det   = side[0] + side[1] + side[2] = d . n   with n = (v1 - v0) x (v2 - v0) = p0 x p1 + p1 x p2 + p2 x p0
///   depth = p0 . (p1 x p2) = p0 . n
/// The line meets the plane at t = depth / det, at the point with weights side[i] / det. So it meets the closed
/// triangle exactly if det is not 0 and no side has the other sign than det. As det is the sum of the sides, that is
/// the same as: no two sides have different signs, and not all are 0. A degenerate triangle and a ray in the plane have
/// det = 0, so there is no hit. (Signed volumes: Segura, Feito. Algorithms to test ray-triangle intersection.
/// Comparative study. WSCG 2001.)
struct ExactSight {
  ExactSight(const RayInDouble& ray, const Triangle& triangle);
  ExactSight(const Ray& ray, const Triangle& triangle) : ExactSight(in_double(ray), triangle) {}

  bool hits_line() const;                     // the line hits the closed triangle, at any t
  bool within(const RayInDouble& ray) const;  // t_min <= t <= t_max; det must not be 0
  bool within(const Ray& ray) const { return within(in_double(ray)); }
  double t() const { return quotient(depth, det); }
  double weight(int vertex) const { return quotient(side[vertex], det); }

  Dyadic side[3], det, depth;
};

/// Returns the sign of the volume of four points, det [b - a, c - a, d - a]: 0 if they lie in a plane. `by_integers`,
/// unless it is null, becomes true if double precision did not tell.
int volume_sign(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d,
                bool* by_integers = nullptr);

/// True if the triangle has an area, without rounding.
bool has_area(const Triangle& triangle);

/// Compares the t of two triangles for the same ray. Neither det may be 0.
std::strong_ordering compare_t(const ExactSight& a, const ExactSight& b);

/// Returns t of b minus t of a, rounded to the nearest double or its neighbour.
double t_apart(const ExactSight& a, const ExactSight& b);

}  // namespace ballot
