// The arithmetic that walks on the host share, with the rounding of the shaders that it names. Internal to
// engine/answer.
#pragma once

#include <bit>
#include <cstdint>
#include <glm/common.hpp>
#include <limits>

#include "engine/core/interruption.h"
#include "engine/tree/formats/pair_decode.h"

namespace ballot::host_arithmetic {

using glm::vec3;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::size_t kMostDepth = 256;  // of trees that are walked here

inline std::uint32_t bits_of(float x) { return std::bit_cast<std::uint32_t>(x); }
inline float float_of(std::uint32_t bits) { return std::bit_cast<float>(bits); }
inline vec3 vec3_of(const glm::uvec4& t) { return as_vec3(t); }

inline float smaller(float a, float b) { return a < b ? a : b; }
inline float larger(float a, float b) { return a > b ? a : b; }
inline float largest(const vec3& v) { return larger(v.x, larger(v.y, v.z)); }
inline bool is_finite(float x) { return (bits_of(x) & 0x7F800000u) != 0x7F800000u; }
inline bool is_finite(const vec3& v) { return is_finite(v.x) && is_finite(v.y) && is_finite(v.z); }

/// lib/numeric/box.glsl
inline float scene_reach(const vec3& lo, const vec3& hi, const vec3& origin) {
  const vec3 to_lo = glm::abs(lo - origin), to_hi = glm::abs(hi - origin);
  return larger(largest(to_lo), largest(to_hi));
}

/// lib/numeric/products.glsl, PRODUCTS_FLOAT64
inline float difference_of_products(float a, float b, float c, float d) {
  return float(double(a) * double(b) - double(c) * double(d));
}

/// Asks now and then during a walk, which may be one through all triangles of a scene.
class WalkWatch {
 public:
  void visit_leaf() {
    if ((++leaves_ & 0xFFF) == 0) check_interruption();
  }

 private:
  std::uint32_t leaves_ = 0;
};

/// A node that is still to be visited.
struct Todo {
  std::uint32_t node;
  float near;
};

/// The children of a node and their boxes, in the form of the layout: as NodeBox of lib/frame/kernel.glsl.
struct Children {
  Bounds l, r;  // of LAYOUT_COMPACT centre and half extents
  std::uint32_t left, right;
};

inline Children children(const glm::uvec4* t) {
  const auto f = [](std::uint32_t bits) { return float_of(bits); };
  return {{{f(t[0].x), f(t[0].z), f(t[2].x)}, {f(t[0].y), f(t[0].w), f(t[2].y)}},
          {{f(t[1].x), f(t[1].z), f(t[2].z)}, {f(t[1].y), f(t[1].w), f(t[2].w)}},
          t[3].x,
          t[3].y};
}

inline Children centred_children(const glm::uvec4* t) {
  return {{as_vec3(t[0]), as_vec3(t[2])}, {as_vec3(t[1]), as_vec3(t[2] << 16u)}, t[0].w, t[1].w};
}

}  // namespace ballot::host_arithmetic
