// Bounds the rounding error of the affine triangle test and of box tests by multiply-add (numeric mode fast).
//
// Let w = 2^-24. The map has rows z, x, y and offsets c, each rounded once. |a|.|b| is the sum of |a_i b_i|.
//   plane distance   Z = o.z + cz     off by 6 w (|o|.|z| + |cz|): the entries, four products and sums
//   closing speed    D = d.z          off by 4 w |d|.|z|
//   t = -Z / D                        off by (eZ + |t| eD) / (|D| - eD) + 6 w |t|; unbounded if |D| <= eD
//   point            p = o + t d      off by w (|o| + 2 |t d|) on each axis, besides t's own error
//   u = p.x + cx                      off by |x|.ep + 6 w (|p|.|x| + |cx|) + |x.d| et
// A box test by multiply-add moves a plane of the box by at most 8 w (|o| + M), where M is the distance of the farthest
// vertex. So a box may cull a hit if the ray passes the border of the triangle by less than that, or if two hits are
// nearer to each other than that. The bound counts this as an error of the plane distance and of the point.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "engine/oracle/judge_range.h"

namespace ballot {
namespace {

double absolute_dot(const glm::dvec3& a, const glm::dvec3& b) { return glm::dot(glm::abs(a), glm::abs(b)); }

// A barycentric coordinate and its error bound.
struct Weight {
  double value, error;
};

Weight weight_of(const RayFrame& ray, const glm::dvec3& row, const glm::dvec3& v0, const Range& range, double moved) {
  const glm::dvec3 o(ray.o[0], ray.o[1], ray.o[2]), d(ray.d[0], ray.d[1], ray.d[2]);
  const glm::dvec3 p = o + range.t * d;
  const glm::dvec3 point_error = kFloatRoundoff * (glm::abs(o) + 2 * std::abs(range.t) * glm::abs(d)) + moved;
  const double rounding = 6 * kFloatRoundoff * (absolute_dot(p, row) + std::abs(glm::dot(v0, row)));
  return {glm::dot(p - v0, row),
          glm::dot(glm::abs(row), point_error) + rounding + std::abs(glm::dot(row, d)) * range.t_error};
}

}  // namespace

Range affine_range(const RayFrame& ray, const Triangle& triangle) {
  const glm::dvec3 o(ray.o[0], ray.o[1], ray.o[2]), d(ray.d[0], ray.d[1], ray.d[2]);
  const glm::dvec3 v0(triangle[0]), e1 = glm::dvec3(triangle[1]) - v0, e2 = glm::dvec3(triangle[2]) - v0;
  const glm::dvec3 n = glm::cross(e1, e2);
  const double nn = glm::dot(n, n);
  Range range;
  range.t_error = std::numeric_limits<double>::infinity();
  if (!(nn > 0)) {
    range.surely_missed = true;
    return range;
  }
  const glm::dvec3 z = n / std::sqrt(nn);
  double reach = 0, start = 0;
  for (const glm::vec3& vertex : triangle)
    for (int k = 0; k < 3; ++k) reach = std::max(reach, std::abs(vertex[k] - ray.o[k]));
  for (const double x : ray.o) start = std::max(start, std::abs(x));
  const double moved = 8 * kFloatRoundoff * (start + reach);
  const double closing = glm::dot(d, z), closing_error = 4 * kFloatRoundoff * absolute_dot(d, z);
  const double plane_error = 6 * kFloatRoundoff * (absolute_dot(o, z) + std::abs(glm::dot(v0, z))) + moved;
  const double room = std::abs(closing) - closing_error;
  if (!(room > 0)) return range;
  range.t = glm::dot(v0 - o, z) / closing;
  range.t_error = (plane_error + std::abs(range.t) * closing_error) / room + 6 * kFloatRoundoff * std::abs(range.t);
  const Weight u = weight_of(ray, glm::cross(e2, n) / nn, v0, range, moved);
  const Weight v = weight_of(ray, glm::cross(n, e1) / nn, v0, range, moved);
  range.u = u.value;
  range.v = v.value;
  range.weight_error = std::max(u.error, v.error);
  const double both = u.error + v.error + 2 * kFloatRoundoff;
  range.surely_hit = u.value > u.error && v.value > v.error && u.value + v.value < 1 - both;
  range.surely_missed = u.value < -u.error || v.value < -v.error || u.value + v.value > 1 + both;
  return range;
}

}  // namespace ballot
