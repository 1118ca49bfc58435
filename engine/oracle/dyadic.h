// Exact arithmetic on what float32 numbers give by additions and products: dyadic rationals, m * 2^e with integers m, e.
#pragma once

#include <boost/multiprecision/cpp_int.hpp>
#include <compare>

namespace ballot {

/// A number m * 2^e, exactly. Every float32 is a multiple of 2^-149 below 2^128, so a polynomial of degree k in them is
/// a multiple of 2^-149k below c * 2^128k, where c counts its terms: at degree 6, the highest in use, 1662 bits and
/// those of c. 2048 are kept, in place; std::overflow_error is thrown if a result would need more.
class Dyadic {
 public:
  Dyadic() = default;
  explicit Dyadic(float x);  // finite

  friend Dyadic operator+(const Dyadic& a, const Dyadic& b);
  friend Dyadic operator-(const Dyadic& a, const Dyadic& b);
  friend Dyadic operator*(const Dyadic& a, const Dyadic& b);
  friend bool operator==(const Dyadic& a, const Dyadic& b) { return (a - b).sign() == 0; }
  friend std::strong_ordering operator<=>(const Dyadic& a, const Dyadic& b) { return (a - b).sign() <=> 0; }
  int sign() const { return m_.sign(); }

  /// a / b to the nearest double or its neighbour: the integer quotient is cut to 64 bits or one more, which costs less
  /// than 2^-63 of it, and then rounded to nearest: the error is below 0.502 ulp. No exact value lies on or beyond the
  /// neighbours of what is returned. b is not 0. Beyond double's range: infinity, or few bits as of any small double.
  friend double quotient(const Dyadic& a, const Dyadic& b);

 private:
  using Integer = boost::multiprecision::number<boost::multiprecision::cpp_int_backend<
      2048, 2048, boost::multiprecision::signed_magnitude, boost::multiprecision::checked, void>>;
  Dyadic(Integer m, int e) : m_(std::move(m)), e_(e) {}
  static Integer shifted(const Integer& m, int bits);
  static Dyadic sum(const Dyadic& a, const Dyadic& b, int sign_of_b);

  Integer m_ = 0;
  int e_ = 0;
};

double quotient(const Dyadic& a, const Dyadic& b);

}  // namespace ballot
