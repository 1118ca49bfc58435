// The range of results that float32 arithmetic may give for a ray and a triangle. Internal to the judge.
#pragma once

#include <limits>

#include "engine/oracle/sight.h"

namespace ballot {

constexpr double kFloatRoundoff = 0x1p-24;  // relative error of one rounding to float32

inline bool is_double(const RayFrame& ray) { return ray.arithmetic == Arithmetic::WoopInDouble; }
/// The relative error of a step of the arithmetic that is judged, in float64 of one of the judge's as well, and below
/// what its numbers may be lost.
inline double roundoff(const RayFrame& ray) { return is_double(ray) ? 0x1p-52 : kFloatRoundoff; }
inline double flush(const RayFrame& ray) { return is_double(ray) ? 0x1p-800 : 0x1p-126; }

/// The results of a triangle test with their error bounds.
struct Range {
  bool surely_hit = false, surely_missed = false;
  double t = 0, t_error = 0;
  double u = 0, v = 0, weight_error = std::numeric_limits<double>::infinity();

  double t_low() const { return t - t_error; }
  double t_high() const { return t + t_error; }
};

/// Returns the range by the error bound of Arithmetic::WoopAffine. It does not check [t_min, t_max]; the caller does.
Range affine_range(const RayFrame& ray, const Triangle& triangle);

}  // namespace ballot
