// How the watertight triangle test keeps its products in float32's range (shaders/lib/triangle_watertight.glsl).
#pragma once

#include <algorithm>
#include <cmath>

#include "engine/scene/scene.h"

namespace ballot {

/// Powers of two. Distances between points of the scene and a ray's origin stay below 2^62 when scaled.
struct ShearScale {
  float scale;  // of coordinates: the longest side comes to [2^55, 2^56), or less where coordinates would overflow
  float
      near;  // how far along an axis an origin may be from box_origin() for that, in scene units; beyond, rays have their own
};

inline ShearScale shear_scale(const Bounds& scene) {
  const glm::vec3 sides = scene.hi - scene.lo, far = glm::max(glm::abs(scene.lo), glm::abs(scene.hi));
  const auto exponent = [](const glm::vec3& v) { return std::ilogb(std::max({v.x, v.y, v.z, 0x1p-126f})); };
  const auto power = [](int e) { return std::ldexp(1.0f, std::clamp(e, -126, 127)); };
  const int scale = std::clamp(std::min(55 - exponent(sides), 125 - exponent(far)), -101, 126);
  return {power(scale), power(59 - scale)};
}

}  // namespace ballot
