#include "engine/oracle/dyadic.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace ballot {

Dyadic::Dyadic(double x) {
  if (x == 0) return;
  int exponent = 0;
  const auto scaled = static_cast<std::int64_t>(std::ldexp(std::frexp(x, &exponent), 53));  // |scaled| < 2^53: exact
  const int zeros = std::countr_zero(static_cast<std::uint64_t>(scaled));
  m_ = scaled / (std::int64_t{1} << zeros);
  e_ = exponent - 53 + zeros;
}

Dyadic Dyadic::sum(const Dyadic& a, const Dyadic& b, int sign_of_b) {
  Dyadic out = a;
  if (b.m_.is_zero()) return out;
  if (a.m_.is_zero()) out.e_ = b.e_;
  if (out.e_ > b.e_) {
    out.m_ <<= static_cast<unsigned>(out.e_ - b.e_);
    out.e_ = b.e_;
  }
  if (b.e_ == out.e_) {
    sign_of_b > 0 ? out.m_ += b.m_ : out.m_ -= b.m_;
  } else {
    const Integer aligned = b.m_ << static_cast<unsigned>(b.e_ - out.e_);
    sign_of_b > 0 ? out.m_ += aligned : out.m_ -= aligned;
  }
  return out;
}

Dyadic operator+(const Dyadic& a, const Dyadic& b) { return Dyadic::sum(a, b, 1); }
Dyadic operator-(const Dyadic& a, const Dyadic& b) { return Dyadic::sum(a, b, -1); }
Dyadic operator*(const Dyadic& a, const Dyadic& b) { return {a.m_ * b.m_, a.e_ + b.e_}; }

double quotient(const Dyadic& a, const Dyadic& b) {
  if (a.m_.is_zero()) return 0;
  Dyadic::Integer top = abs(a.m_), bottom = abs(b.m_);
  int exponent = a.e_ - b.e_;
  const int shift = 64 + static_cast<int>(msb(bottom)) - static_cast<int>(msb(top));  // the quotient has 64 or 65 bits
  (shift > 0 ? top : bottom) <<= static_cast<unsigned>(std::abs(shift));
  exponent -= shift;
  top /= bottom;
  const auto high = static_cast<std::uint64_t>(top >> 32), low = static_cast<std::uint64_t>(top & 0xFFFFFFFFu);
  // Both terms are exact doubles of at most 33 bits. Their sum is rounded once.
  const double q = std::ldexp(static_cast<double>(high), 32) + static_cast<double>(low);
  return std::ldexp(a.sign() == b.sign() ? q : -q, exponent);
}

Dyadic square_root(const Dyadic& a) {
  if (a.m_.is_zero()) return {};
  // An integer root of 160 bits or more, of a number with an even exponent.
  int shift = std::max(0, 322 - static_cast<int>(msb(a.m_)));
  shift += (a.e_ - shift) & 1;
  return {sqrt(Dyadic::Integer(a.m_ << static_cast<unsigned>(shift))), (a.e_ - shift) / 2};
}

DyadicVec difference(const glm::dvec3& a, const glm::dvec3& b) {
  return {Dyadic(a.x) - Dyadic(b.x), Dyadic(a.y) - Dyadic(b.y), Dyadic(a.z) - Dyadic(b.z)};
}

DyadicVec cross(const DyadicVec& a, const DyadicVec& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Dyadic dot(const DyadicVec& a, const DyadicVec& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

}  // namespace ballot
