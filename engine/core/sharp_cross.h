// Cross products in double precision that lose nothing to cancellation.
#pragma once

#include <cmath>
#include <glm/vec3.hpp>

namespace ballot {

/// Returns a b - c d with a relative error of at most 2 * 2^-53 (Kahan; Jeannerod, Louvet and Muller 2013).
inline double difference_of_products(double a, double b, double c, double d) {
  const double cd = c * d;
  return std::fma(a, b, -cd) + std::fma(-c, d, cd);
}

/// Returns the cross product; each component has that error.
inline glm::dvec3 sharp_cross(const glm::dvec3& a, const glm::dvec3& b) {
  return {difference_of_products(a.y, b.z, a.z, b.y), difference_of_products(a.z, b.x, a.x, b.z),
          difference_of_products(a.x, b.y, a.y, b.x)};
}

}  // namespace ballot
