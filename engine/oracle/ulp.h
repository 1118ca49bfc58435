// Errors of float32 answers, in units of the last place. Internal to engine/oracle.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace ballot {

/// Returns the ulp of float32 at t. For denormal numbers it is that of the smallest normal number.
inline double ulp(double t) {
  constexpr double kSmallest = std::numeric_limits<float>::min();
  return std::ldexp(1, std::ilogb(std::max(std::abs(t), kSmallest)) - 23);
}
inline double in_ulps(double difference, double t) { return difference / ulp(t); }

}  // namespace ballot
