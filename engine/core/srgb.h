// sRGB, the encoding of colours in 8-bit pictures and in files of vertices.
#pragma once

#include <algorithm>
#include <cmath>

namespace ballot {

/// Returns the linear value of an sRGB one in [0, 1], by IEC 61966-2-1. What is outside is clamped; what is no number
/// becomes 0.
inline float linear_of(float srgb) {
  const float c = srgb > 0 ? std::min(srgb, 1.0f) : 0.0f;
  return c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f);
}

}  // namespace ballot
