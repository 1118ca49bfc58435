// The scale that keeps products of the watertight triangle test within float32's range
// (shaders/lib/numeric/triangle_watertight.glsl).
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

#include "engine/core/geometry.h"

namespace ballot {

/// The scale of a scene, and how far it reaches. Both are powers of two. Scaled distances between points of the scene
/// and a ray's origin stay below 2^62, whichever scale the ray takes: along an axis where box_origin() is zero, all
/// points of the scene have coordinates of at most 17 times its longest side.
struct ShearScale {
  /// The scale of coordinates. It takes the longest side to [2^55, 2^56), or to less where coordinates or the scale
  /// itself would overflow.
  float scale;
  /// The largest distance of a ray's origin from box_origin(), along any axis and in scene units, for which `scale`
  /// holds. Rays from farther away have a scale of their own.
  float near;
};

/// Returns the scale of a scene with these bounds, which may be degenerate or infinite.
inline ShearScale shear_scale(const Bounds& scene) {
  const glm::vec3 sides = scene.hi - scene.lo, far = glm::max(glm::abs(scene.lo), glm::abs(scene.hi));
  const auto exponent = [](const glm::vec3& v) { return std::ilogb(std::max({v.x, v.y, v.z, 0x1p-126f})); };
  const auto power = [](int e) { return std::ldexp(1.0f, std::clamp(e, -126, 127)); };
  const int scale = std::clamp(std::min(55 - exponent(sides), 125 - exponent(far)), -73, 126);  // -73: sides of 2^128
  return {power(scale), power(60 - scale)};
}

}  // namespace ballot
