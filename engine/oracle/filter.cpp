// The filter's error bounds. The notation is that of predicates.h, and u = 2^-53. Every operation in double precision
// gives its exact result times 1 + e, |e| <= u, unless it leaves the range. None of them does:
//
// Range. Float32 numbers are multiples of 2^-149 below 2^128. A difference of two is at most 2^129 and, rounded, still
// a multiple of 2^-149. A product of two is a multiple of 2^-298, and at least 2^-298 if it is not 0. Rounding keeps
// that, for numbers of 53 bits. The same holds for every sum and product up to degree 3: values are 0 or between 2^-447
// and 2^390. t is a quotient of two such numbers: below 2^840 and, if it is not 0, above 2^-840. Error bounds are
// products of such values and 2^-49. Where t times the error of det overflows, t_bounds is unbounded. Where it
// underflows, the error of depth absorbs it, which is above 2^-497 if it is not 0. (If the error of depth is 0, then p0
// and t are 0 too, and the interval [0, 0] is right.) Rays of instances in double are sums of products of float32
// numbers: multiples of 2^-298 below 2^258. So values are 0 or between 2^-894 and 2^777 for these.
//
// Sides. Let m be the largest |p_ik| and s = |dx| + |dy| + |dz|. p is off by u m. A product of two components is off by
// 3 u m^2 (two factors, one rounding). A component of a cross product is a difference of two products and at most
// 2 m^2; it is off by 2 * 3 u m^2 + 2 u m^2 = 8 u m^2. Multiplied by d_k and rounded, it is off by |d_k| (8 + 2) u m^2.
// Summed over k, that is 10 u m^2 s. The two additions, of sums up to 2 m^2 s, add 4 u m^2 s. Together that is
// 14 u m^2 s and terms of order u^2. 16 is used, which also covers the rounding of m, of s and of the bound itself
// (each a few u of it).
//
// Where that is not enough: a side is a sum of six products d_k p_bi p_cj. Let a be the sum of their sizes. A product
// of two components is off by 3 u of its size. The difference of two products is off by u of both sizes more. After the
// multiplication by d_k it is 5 u, and after two additions 7 u. So a side is off by 7 u a; 8 is used. If a is 0, then
// each product is 0, and the side is exactly 0. That is the case for rays in a plane of two axes, or through an edge
// along an axis.
//
// det and depth. det = n . d and depth = n . p0, with n from the edges e1 = v1 - v0 and e2 = v2 - v0, which are
// differences of float32 numbers too. Let h be the largest component of the edges. n is off by 8 u h^2 and at most
// 2 h^2. det is off by 14 u h^2 s as above. In depth, p0 is off by u of itself as well, which gives |p0_k| (8 + 2 + 2)
// u h^2; summed with two additions, it is (12 + 4) u h^2 (|p0x| + |p0y| + |p0z|). 20 is used for both.
//
// t. Let q = depth' / det' be the quotient of the computed numbers, where depth' is off by a and det' by b. With the
// exact t = depth / det, q - t = (q det - depth) / det = (q (det' +- b) - (depth' +- a)) / det, so
// |q - t| <= (a + |q| b) / (|det'| - b). The rounding of q and of that bound is covered by its factor 1 + 2^-48 and by
// 4 u |q|.
#include "engine/oracle/filter.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ballot {
namespace {

constexpr double kDoubleRoundoff = 0x1p-53;

double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

void cross(const double* a, const double* b, double* out) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

// Computes a - b. Returns the size of its largest component.
double subtract(const glm::vec3& a, const double* b, double* out) {
  out[0] = a.x - b[0];
  out[1] = a.y - b[1];
  out[2] = a.z - b[2];
  return std::max(std::max(std::abs(out[0]), std::abs(out[1])), std::abs(out[2]));
}

}  // namespace

FilterRay::FilterRay(const RayInDouble& ray) : length(0), t_min(ray.t_min), t_max(ray.t_max) {
  for (int k = 0; k < 3; ++k) {
    o[k] = ray.origin[k];
    d[k] = ray.dir[k];
    inverse_d[k] = d[k] == 0 ? 0 : 1 / d[k];
    length += std::abs(d[k]);
  }
}

FilterSight::FilterSight(const FilterRay& ray, const Triangle& triangle) : ray_(ray), triangle_(triangle) {
  double across[3], largest = 0;
  for (std::size_t i = 0; i < 3; ++i) largest = std::max(largest, subtract(triangle[i], ray.o, p_[i]));
  for (int i = 0; i < 3; ++i) {
    cross(p_[(i + 1) % 3], p_[(i + 2) % 3], across);
    side_[i] = dot(ray.d, across);
  }
  side_error_ = 16 * kDoubleRoundoff * largest * largest * ray.length;
}

// If the error of a side is 0, its sign is certain too: the side is 0.
Sure FilterSight::decide(const double (&error)[3]) const {
  int above = 0, below = 0, zero = 0;
  for (int i = 0; i < 3; ++i) {
    above += side_[i] > error[i] ? 1 : 0;
    below += side_[i] < -error[i] ? 1 : 0;
    zero += error[i] == 0 && side_[i] == 0 ? 1 : 0;
  }
  if ((above > 0 && below > 0) || zero == 3) return Sure::No;
  return above + zero == 3 || below + zero == 3 ? Sure::Yes : Sure::Unsure;
}

double FilterSight::error_by_products(int side) const {
  const double* const b = p_[(side + 1) % 3];
  const double* const c = p_[(side + 2) % 3];
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    sum += std::abs(ray_.d[k]) * (std::abs(b[i] * c[j]) + std::abs(b[j] * c[i]));
  }
  return 8 * kDoubleRoundoff * sum;
}

Sure FilterSight::hits_line() const {
  const Sure quick = decide({side_error_, side_error_, side_error_});
  if (quick != Sure::Unsure) return quick;
  return decide({error_by_products(0), error_by_products(1), error_by_products(2)});
}

Sure FilterSight::decide_strictly(const double (&error)[3]) const {
  int above = 0, below = 0;
  for (int i = 0; i < 3; ++i) {
    above += side_[i] > error[i] ? 1 : 0;
    below += side_[i] < -error[i] ? 1 : 0;
  }
  if (above > 0 && below > 0) return Sure::No;
  return above == 3 || below == 3 ? Sure::Yes : Sure::Unsure;
}

Sure FilterSight::crosses_line() const {
  const Sure quick = decide_strictly({side_error_, side_error_, side_error_});
  if (quick != Sure::Unsure) return quick;
  return decide_strictly({error_by_products(0), error_by_products(1), error_by_products(2)});
}

// det is the sum of the sides, each off by side_error_; 2^-51 of its parts cover the two additions.
int FilterSight::side_of_plane() const {
  const double det = side_[0] + side_[1] + side_[2];
  const double size = std::abs(side_[0]) + std::abs(side_[1]) + std::abs(side_[2]);
  const double error = 3 * side_error_ + 0x1p-51 * size;
  return det > error ? 1 : det < -error ? -1 : 0;
}

// A weight is side / det. With both off by e at most 3 side_error_, its error is at most 2 e / (|det| - e), as the
// weight is at most 1; the roundings are a few 2^-53.
bool FilterSight::weights(double& u, double& v, double error) const {
  const double det = side_[0] + side_[1] + side_[2], e = 3 * side_error_ + 0x1p-50 * std::abs(det);
  u = side_[1] / det, v = side_[2] / det;
  return 2 * e <= error * (std::abs(det) - e);
}

Interval FilterSight::t_bounds() const {
  const double v0[3] = {triangle_[0].x, triangle_[0].y, triangle_[0].z};
  double e1[3], e2[3], n[3], p0[3];
  const double h = std::max(subtract(triangle_[1], v0, e1), subtract(triangle_[2], v0, e2));
  subtract(triangle_[0], ray_.o, p0);
  cross(e1, e2, n);
  const double det = dot(n, ray_.d), depth = dot(n, p0);
  const double unit = 20 * kDoubleRoundoff * h * h;
  const double det_error = unit * ray_.length;
  const double depth_error = unit * (std::abs(p0[0]) + std::abs(p0[1]) + std::abs(p0[2]));
  const double room = std::abs(det) - det_error;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (!(room > 0)) return {-kInfinity, kInfinity};
  const double t = depth / det;
  const double error =
      (depth_error + std::abs(t) * det_error) / room * (1 + 0x1p-48) + 4 * kDoubleRoundoff * std::abs(t);
  return {t - error, t + error};
}

}  // namespace ballot
