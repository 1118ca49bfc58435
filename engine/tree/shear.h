// The scale of coordinates that keeps the products of the watertight triangle test in float32's range
// (shaders/lib/numeric/triangle_watertight.glsl).
#pragma once

#include <algorithm>
#include <cmath>

#include "engine/scene/scene.h"

namespace ballot {

/// Two powers of two. Scaled distances between points of the scene and a ray's origin stay below 2^62, whichever scale
/// the ray takes. (Where box_origin() is zero along an axis, the scene's points lie within 17 of its longest sides.)
struct ShearScale {
  /// Multiplies coordinates. The scene's longest side comes to [2^55, 2^56), or less where coordinates or the scale
  /// itself would overflow.
  float scale;
  /// The largest distance of an origin from box_origin() along an axis, in scene units, at which rays take `scale`.
  /// Rays from beyond have a scale of their own.
  float near;
};

/// The scale for a scene with these bounds. Degenerate and infinite bounds are allowed.
inline ShearScale shear_scale(const Bounds& scene) {
  const glm::vec3 sides = scene.hi - scene.lo, far = glm::max(glm::abs(scene.lo), glm::abs(scene.hi));
  const auto exponent = [](const glm::vec3& v) { return std::ilogb(std::max({v.x, v.y, v.z, 0x1p-126f})); };
  const auto power = [](int e) { return std::ldexp(1.0f, std::clamp(e, -126, 127)); };
  const int scale = std::clamp(std::min(55 - exponent(sides), 125 - exponent(far)), -73, 126);  // -73: sides of 2^128
  return {power(scale), power(60 - scale)};
}

}  // namespace ballot
