// Numbers in double with a bound of their error. Internal to engine/oracle.
//
// With u = 2^-53: a sum rounds by at most u of itself, a product, quotient or root by that and 2^-1075 if it is tiny.
// The bounds are sums of products of numbers that are not negative, of a few operations; the factor kRoom holds what
// those round.
#pragma once

#include <cmath>
#include <limits>
#include <optional>

namespace ballot {

/// A number within `error` of `value`. Beyond the range of double the error is infinite or NaN, so no sign is sure.
struct Bounded {
  double value = 0, error = 0;

  Bounded() = default;
  explicit Bounded(float x) : value(x) {}
  Bounded(double v, double e) : value(v), error(e) {}

  bool is_zero() const { return value == 0 && error == 0; }

  friend Bounded operator+(const Bounded& a, const Bounded& b) { return rounded(a.value + b.value, a.error + b.error); }
  friend Bounded operator-(const Bounded& a, const Bounded& b) { return rounded(a.value - b.value, a.error + b.error); }
  friend Bounded operator*(const Bounded& a, const Bounded& b) {
    if (a.is_zero() || b.is_zero()) return {};
    return rounded(a.value * b.value,
                   std::abs(a.value) * b.error + std::abs(b.value) * a.error + a.error * b.error + kTiny);
  }
  /// b must not be 0 within its error, else nothing is known of the quotient.
  friend Bounded operator/(const Bounded& a, const Bounded& b) {
    const double least = std::abs(b.value) - b.error, q = a.value / b.value;
    if (!(least > 0)) return {0, std::numeric_limits<double>::infinity()};
    return rounded(q, (a.error + std::abs(q) * b.error) / least * kRoom + kTiny);
  }
  /// The number must not be below 0. |sqrt(x) - sqrt(v)| = |x - v| / (sqrt(x) + sqrt(v)).
  friend Bounded square_root(const Bounded& a) {
    if (a.is_zero()) return {};
    if (!(a.value > 0)) return {0, std::sqrt(a.error + std::abs(a.value)) * kRoom};
    const double root = std::sqrt(a.value);
    return rounded(root, a.error / root + kTiny);
  }

  double low() const { return value - error - kWiden * std::abs(value); }
  double high() const { return value + error + kWiden * std::abs(value); }

 private:
  static constexpr double kRoom = 1 + 0x1p-48, kTiny = 0x1p-1070, kWiden = 0x1p-51;
  static Bounded rounded(double value, double error) { return {value, (error + 0x1p-53 * std::abs(value)) * kRoom}; }
};

/// Returns the sign of a number: -1, 0 or 1; nothing if its error hides it.
inline std::optional<int> sign_of(const Bounded& x) {
  if (x.value > x.error) return 1;
  if (x.value < -x.error) return -1;
  return x.is_zero() ? std::optional(0) : std::nullopt;
}

}  // namespace ballot
