// Sums of weights, whose bits do not depend on the order of the rays: what the weights are rounded to.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace ballot {

/// What sums are by, and how many kinds there are.
enum class SumsBy { Prim, Instance, Mesh };
inline constexpr std::size_t kSumsBy = 3;

/// The unit that weights are rounded to: 2^(e + l - 61), with e the exponent of the largest one, at least -126, and l
/// the logarithm to base 2, rounded up, of how many are added at most. So no sum of 64 bits overflows.
class SumUnit {
 public:
  /// `largest`: bits of the largest size of a weight, which is finite.
  SumUnit(std::uint32_t largest, std::uint64_t count) : lift_(lift_of(count)), exponent_(exponent_of(largest)) {}

  /// The bits of a finite weight's size order as the sizes do.
  static std::uint32_t size_of(float weight) { return std::bit_cast<std::uint32_t>(weight) & 0x7FFFFFFFu; }
  static bool is_finite(std::uint32_t size) { return size < 0x7F800000u; }
  /// How many bits a weight as large as the largest is lifted above its last bit.
  static int lift_of(std::uint64_t count) { return 38 - (count > 1 ? int(std::bit_width(count - 1)) : 0); }

  /// Returns the nearest multiple, of two that are as near the even one.
  std::int64_t whole(float weight) const {
    const std::uint32_t size = size_of(weight);
    const std::uint64_t digits = size < 0x800000u ? size : (size & 0x7FFFFFu) | 0x800000u;
    const int shift = exponent_of(size) - exponent_ + lift_;
    std::uint64_t rounded = 0;
    if (shift >= 0)
      rounded = digits << shift;
    else if (shift >= -24)
      rounded = (digits + (std::uint64_t{1} << (-shift - 1)) - 1 + (digits >> -shift & 1)) >> -shift;
    return std::signbit(weight) ? -std::int64_t(rounded) : std::int64_t(rounded);
  }
  /// Returns a sum of multiples as the nearest number.
  double number(std::int64_t sum) const { return std::ldexp(double(sum), exponent_ - 150 - lift_); }

 private:
  static int exponent_of(std::uint32_t size) { return int(std::max(size >> 23, 1u)); }
  int lift_, exponent_;
};

}  // namespace ballot
