// The grid of a node whose boxes take a byte a plane.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace ballot {

/// The difference to - from, kept exactly as rounded + rest.
///
/// Source: Ole Moeller. Quasi double-precision in floating point addition. BIT 5, 1965.
struct Difference {
  double rounded, rest;
  Difference(float to, float from) : rounded(double(to) - from) {
    const double part = rounded - to;
    rest = (double(to) - (rounded - part)) - (double(from) + part);
  }
  bool at_least(double x) const { return x < rounded || (x == rounded && rest >= 0); }
  bool at_most(double x) const { return x > rounded || (x == rounded && rest <= 0); }
};

/// The grid of a node along one axis: the positions first + q * step with q from 0 to 255. The products are exact in
/// double precision. Rounding to the grid is exact too.
struct Grid {
  static constexpr int kSteps = 255;
  // The smallest step. Its products with directions are not denormal, so no device flushes them to zero.
  static constexpr float kSmallestStep = 0x1p-120f;

  float first, step;
  Grid(float lo, float hi) : first(lo) {
    const Difference extent(hi, lo);
    step = std::max(float(extent.rounded / kSteps), kSmallestStep);
    while (!extent.at_most(double(step) * kSteps)) step = std::nextafter(step, std::numeric_limits<float>::infinity());
  }
  /// Returns the largest q whose position is not above x.
  std::uint32_t below(float x) const {
    const Difference d(x, first);
    int q = std::clamp(int(d.rounded / step), 0, kSteps);
    while (q < kSteps && d.at_least(double(step) * (q + 1))) ++q;
    while (!d.at_least(double(step) * q)) --q;
    return std::uint32_t(q);
  }
  /// Returns the smallest q whose position is not below x.
  std::uint32_t above(float x) const {
    const Difference d(x, first);
    int q = std::clamp(int(d.rounded / step), 0, kSteps);
    while (!d.at_most(double(step) * q)) ++q;
    while (q > 0 && d.at_most(double(step) * (q - 1))) --q;
    return std::uint32_t(q);
  }
};

}  // namespace ballot
