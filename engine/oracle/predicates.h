// What an exact decision about a ray and a triangle comes from. No rounding anywhere.
#pragma once

#include <compare>

#include "engine/oracle/dyadic.h"
#include "engine/scene/scene.h"
#include "shaders/shared/layout.h"

namespace ballot {

/// A ray o + t d and a triangle v0 v1 v2, with p_i = v_i - o.
///
/// side[0] = d . (p1 x p2), side[1] = d . (p2 x p0), side[2] = d . (p0 x p1): six times the signed volumes that the ray
/// spans with the edges. They depend on the edge alone but for their sign, so neighbours agree on a shared edge.
///   det   = side[0] + side[1] + side[2] = d . n   with n = (v1 - v0) x (v2 - v0) = p0 x p1 + p1 x p2 + p2 x p0
///   depth = p0 . (p1 x p2) = p0 . n
/// The line meets the plane at t = depth / det, at the point with weights side[i] / det; so it meets the closed
/// triangle exactly if det is not 0 and no side has the other sign than det. As det is the sum, that is: no two sides
/// have different signs, and not all are 0. A degenerate triangle and a ray in the plane have det = 0: no hit.
/// (Signed volumes: Segura, Feito. Algorithms to test ray-triangle intersection. Comparative study. WSCG 2001.)
struct ExactSight {
  ExactSight(const Ray& ray, const Triangle& triangle);

  bool hits_line() const;             // the closed triangle, for some t
  bool within(const Ray& ray) const;  // t_min <= t <= t_max; det != 0
  double t() const { return quotient(depth, det); }
  double weight(int vertex) const { return quotient(side[vertex], det); }

  Dyadic side[3], det, depth;
};

/// The order of the two t; both det != 0, of the same ray.
std::strong_ordering compare_t(const ExactSight& a, const ExactSight& b);

/// t of b less t of a, to the nearest double or its neighbour.
double t_apart(const ExactSight& a, const ExactSight& b);

}  // namespace ballot
