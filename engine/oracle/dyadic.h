// Exact arithmetic on dyadic rationals, m * 2^e with integers m and e. Sums and products of floating-point numbers are
// such numbers.
#pragma once

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <compare>
#include <glm/vec3.hpp>

namespace ballot {

/// An exact number m * 2^e. Every float32 is a multiple of 2^-149 below 2^128. So a polynomial of degree k in float32
/// numbers is a multiple of 2^-149k below c * 2^128k, where c counts its terms. At degree 10 (two distances from
/// planes) that is 2770 bits and those of c, at degree 32, the highest in use (two round cones), 8864. Nearly all
/// numbers fit the 512 bits that are kept in place; longer ones lie on the heap, as more of
/// those do that come of doubles.
class Dyadic {
 public:
  Dyadic() = default;
  explicit Dyadic(double x);  // x must be finite

  friend Dyadic operator+(const Dyadic& a, const Dyadic& b);
  friend Dyadic operator-(const Dyadic& a, const Dyadic& b);
  friend Dyadic operator*(const Dyadic& a, const Dyadic& b);
  friend bool operator==(const Dyadic& a, const Dyadic& b) { return (a - b).sign() == 0; }
  friend std::strong_ordering operator<=>(const Dyadic& a, const Dyadic& b) { return (a - b).sign() <=> 0; }
  int sign() const { return m_.sign(); }

  /// Returns a / b, rounded to the nearest double or its neighbour; b must not be 0. The integer quotient is cut to 64
  /// or 65 bits, which loses less than 2^-63 of it, and is then rounded to nearest. So the error is below 0.502 ulp,
  /// and the exact value lies strictly between the neighbours of the result. Beyond the range of double the result is
  /// infinity, or has few bits like any small double.
  friend double quotient(const Dyadic& a, const Dyadic& b);

  /// Returns a number that is not above the square root of a, which must not be below 0, by at most 2^-160 of it.
  friend Dyadic square_root(const Dyadic& a);

 private:
  using Integer = boost::multiprecision::number<
      boost::multiprecision::cpp_int_backend<512, 0, boost::multiprecision::signed_magnitude,
                                             boost::multiprecision::unchecked>,
      boost::multiprecision::et_off>;
  Dyadic(Integer m, int e) : m_(std::move(m)), e_(e) {}
  static Dyadic sum(const Dyadic& a, const Dyadic& b, int sign_of_b);

  Integer m_ = 0;
  int e_ = 0;
};

double quotient(const Dyadic& a, const Dyadic& b);
Dyadic square_root(const Dyadic& a);

/// An exact vector.
using DyadicVec = std::array<Dyadic, 3>;
DyadicVec difference(const glm::dvec3& a, const glm::dvec3& b);  // a - b, which must be finite
DyadicVec cross(const DyadicVec& a, const DyadicVec& b);
Dyadic dot(const DyadicVec& a, const DyadicVec& b);

}  // namespace ballot
