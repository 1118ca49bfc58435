// How the watertight triangle test keeps its products in float32's range
// (shaders/lib/numeric/triangle_watertight.glsl).
#pragma once

#include <algorithm>
#include <cmath>

#include "engine/scene/scene.h"

namespace ballot {

/// Powers of two. Distances between points of the scene and a ray's origin stay below 2^62 when scaled, whichever scale
/// the ray takes: where box_origin() is zero along an axis, the scene's points lie within 17 of its longest sides of
/// it.
struct ShearScale {
  /// Of coordinates: the longest side comes to [2^55, 2^56), or less where coordinates or the scale itself would
  /// overflow.
  float scale;
  /// How far along an axis an origin may be from box_origin() for that, in scene units; rays from beyond have a scale
  /// of their own.
  float near;
};

/// Of the scene with these bounds, degenerate and infinite ones included.
inline ShearScale shear_scale(const Bounds& scene) {
  const glm::vec3 sides = scene.hi - scene.lo, far = glm::max(glm::abs(scene.lo), glm::abs(scene.hi));
  const auto exponent = [](const glm::vec3& v) { return std::ilogb(std::max({v.x, v.y, v.z, 0x1p-126f})); };
  const auto power = [](int e) { return std::ldexp(1.0f, std::clamp(e, -126, 127)); };
  const int scale = std::clamp(std::min(55 - exponent(sides), 125 - exponent(far)), -73, 126);  // -73: sides of 2^128
  return {power(scale), power(60 - scale)};
}

}  // namespace ballot
