// The conservative box test of the exact oracle: it culls no box that may hold an exact hit. Internal to engine/oracle.
//
// A triangle may lie in several leaves. Each of them has a box of a part of it, and the boxes of the parts cover the
// triangle (engine/tree/host/build.h, split_reference; check_bvh). So a hit point lies in the box of some leaf that
// holds the triangle, and in the boxes of all nodes above. Two conditions suffice: no box with a point o + t d,
// t_min <= t <= t_far, is culled, and t_far is never less than the exact t of the nearest hit.
//
// The ray enters and leaves slab k of a box at (lo - o_k) / d_k and (hi - o_k) / d_k, in some order. Computed as
// fl(fl(lo - o_k) * fl(1 / d_k)), each is its exact value times (1 + e)^3, |e| <= u = 2^-53. For lo and o_k are
// float32, so the difference is 0 or between 2^-149 and 2^129, 1 / d_k is between 2^-128 and 2^149, and nothing leaves
// the range of double. So the exact values are within 4 u of the computed ones. The largest entry and the smallest exit
// are widened by 8 u of themselves. That covers the error and the rounding of the widening itself. (x - 8 u |x| grows
// with x, so the largest of the widened entries is the widened largest entry.) Where d_k = 0, o_k lies in the slab for
// all t or for none. That is decided by an exact comparison of float32 numbers.
#pragma once

#include <cmath>
#include <optional>

#include "engine/oracle/filter.h"
#include "engine/oracle/walker.h"

namespace ballot {

/// Returns a lower bound of the t at which the ray enters the box, or nothing if the ray surely misses it in
/// [t_min, t_far].
inline std::optional<double> enter(const FilterRay& ray, const Bounds& box, double t_far) {
  double near = ray.t_min, far = t_far;
  constexpr double kNoPad[3] = {0, 0, 0};
  if (!cut_to_box(ray, box, kNoPad, near, far)) return std::nullopt;
  constexpr double kWiden = 0x1p-50;
  near -= kWiden * std::abs(near);
  far += kWiden * std::abs(far);
  return near <= far ? std::optional(near) : std::nullopt;
}

}  // namespace ballot
