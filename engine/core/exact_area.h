// Areas of triangles with float32 vertices, without rounding.
//
// A component of the cross product of two edges is a sum of six products of two coordinates. Each product is a double
// without rounding: it has 48 bits, and is 0 or at least 2^-298. The products are added as an expansion, a sum of
// doubles that do not overlap (Jonathan Shewchuk. Adaptive Precision Floating-Point Arithmetic and Fast Robust
// Geometric Predicates. Discrete & Computational Geometry 18, 1997, section 2). It is zero only if all of them are.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <glm/vec3.hpp>

namespace ballot {

/// Returns a sum of doubles, none of which overflows when added: its sign is right, and its value to a few 2^-53.
inline double exact_sum(const std::array<double, 6>& terms) {
  std::array<double, 6> parts{};
  for (std::size_t i = 0; i < terms.size(); ++i) {
    double sum = terms[i];
    for (std::size_t k = 0; k < i; ++k) {
      const double next = sum + parts[k], other = next - sum;
      parts[k] = (sum - (next - other)) + (parts[k] - other);
      sum = next;
    }
    parts[i] = sum;
  }
  double all = 0;
  for (const double part : parts) all += part;
  return all;
}

/// Returns a b - c d with a relative error of at most 2 * 2^-53 (Kahan; Jeannerod, Louvet and Muller 2013).
inline double difference_of_products(double a, double b, double c, double d) {
  const double cd = c * d;
  return std::fma(a, b, -cd) + std::fma(-c, d, cd);
}

/// True if `difference` is a - b without rounding, each component rounded.
inline bool is_exact_difference(const glm::dvec3& difference, const glm::dvec3& a, const glm::dvec3& b) {
  const glm::dvec3 back = a - difference;
  return back == b && difference + back == a;
}

/// Returns the cross product (q - p) x (r - p) of float32 numbers. Each component is zero only if it is so without
/// rounding, and has a relative error of a few 2^-53.
inline glm::dvec3 exact_cross_sums(const glm::dvec3& p, const glm::dvec3& q, const glm::dvec3& r) {
  glm::dvec3 cross;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    cross[i] = exact_sum({q[j] * r[k], -(q[k] * r[j]), r[j] * p[k], -(r[k] * p[j]), p[j] * q[k], -(p[k] * q[j])});
  }
  return cross;
}

/// The same, (b - a) x (c - a), quicker.
inline glm::dvec3 exact_cross(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
  const glm::dvec3 p(a), q(b), r(c), e = q - p, f = r - p;
  if (!is_exact_difference(e, q, p) || !is_exact_difference(f, r, p)) return exact_cross_sums(p, q, r);
  return {difference_of_products(e.y, f.z, e.z, f.y), difference_of_products(e.z, f.x, e.x, f.z),
          difference_of_products(e.x, f.y, e.y, f.x)};
}

/// True if the three vertices lie on a line or at one point, without rounding.
inline bool has_no_area(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
  // Differences and products round by at most 4 * 2^-53 of the two products' sizes.
  const glm::dvec3 p(a), e = glm::dvec3(b) - p, f = glm::dvec3(c) - p;
  for (int i = 0; i < 3; ++i) {
    const double x = e[(i + 1) % 3] * f[(i + 2) % 3], y = e[(i + 2) % 3] * f[(i + 1) % 3];
    if (std::abs(x - y) > 0x1p-50 * (std::abs(x) + std::abs(y))) return false;
  }
  return exact_cross(a, b, c) == glm::dvec3(0);
}

}  // namespace ballot
