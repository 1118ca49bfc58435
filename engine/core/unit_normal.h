// Unit normals of triangles, whose bits hosts and devices share (shaders/lib/query/unit_normal.glsl).
#pragma once

#include <bit>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/vector_relational.hpp>

#include "engine/core/exact_area.h"

namespace ballot {

/// Returns 1 / sqrt(x) of a positive number with a relative error of a few 2^-53, by sums and products alone: Newton's
/// steps from a start that is right to 3.5 %, which square the error.
inline double inverse_root(double x) {
  const auto high = static_cast<std::uint32_t>(std::bit_cast<std::uint64_t>(x) >> 32);
  double y = std::bit_cast<double>(std::uint64_t{0x5FE6EB50u - (high >> 1)} << 32);
  const double half_x = 0.5 * x;
  for (int step = 0; step < 4; ++step) y = y * (1.5 - half_x * (y * y));
  return y;
}

/// Returns the cross product (b - a) x (c - a) of float32 numbers, each component with a relative error of at most
/// 2^-42. It is taken in double where the edges are exact there and each component is at least 2^-10 of what its two
/// products amount to: the products round by 2^-53. Else it is exact_cross()'s sum.
inline glm::dvec3 area_vector(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
  const glm::dvec3 p(a), q(b), r(c), e = q - p, f = r - p;
  const glm::dvec3 x(e.y * f.z, e.z * f.x, e.x * f.y), y(e.z * f.y, e.x * f.z, e.y * f.x);
  const glm::dvec3 n = x - y, least = 0x1p-10 * (glm::abs(x) + glm::abs(y));
  if (is_exact_difference(e, q, p) && is_exact_difference(f, r, p) &&
      glm::all(glm::greaterThanEqual(glm::abs(n), least)))
    return n;
  return exact_cross_sums(p, q, r);
}

/// Returns the unit normal of a triangle, by the right-hand rule; zero if it has no area. Each component is off by at
/// most half a unit of its last place and 2^-42 of itself. Zeros have no sign.
inline glm::vec3 unit_normal(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
  const glm::dvec3 n = area_vector(a, b, c);
  const double square = n.x * n.x + n.y * n.y + n.z * n.z;
  return square > 0 ? glm::vec3(n * inverse_root(square)) + 0.f : glm::vec3(0);
}

}  // namespace ballot
