// What float32 arithmetic may make of a ray and a triangle. Internal to the judge.
#pragma once

#include <limits>

#include "engine/oracle/sight.h"

namespace ballot {

constexpr double kFloatRoundoff = 0x1p-24;  // of one rounding to float32, relative

struct Range {
  bool surely_hit = false, surely_missed = false;
  double t = 0, t_error = 0;
  double u = 0, v = 0, weight_error = std::numeric_limits<double>::infinity();

  double t_low() const { return t - t_error; }
  double t_high() const { return t + t_error; }
};

/// By the bound of Arithmetic::WoopAffine; the ray's own range of t is left to the caller.
Range affine_range(const RayFrame& ray, const Triangle& triangle);

}  // namespace ballot
