// Decodes the binary tree's device arrays on the CPU.
#pragma once

#include <bit>
#include <cmath>
#include <limits>

#include "engine/tree/formats/pair.h"

namespace ballot {

/// A child of a node: its box and its reference.
struct DeviceChild {
  Bounds box;
  std::uint32_t ref = END_OF_TREE;  // child reference, as shaders/shared/layout.h defines it
};

struct DevicePair {
  DeviceChild left, right;
};

inline float as_float(std::uint32_t bits) { return std::bit_cast<float>(bits); }
inline glm::vec3 as_vec3(const glm::uvec4& t) { return {as_float(t.x), as_float(t.y), as_float(t.z)}; }

inline bool is_leaf(std::uint32_t ref) { return (ref & LEAF_BIT) != 0; }
inline std::uint32_t leaf_count(std::uint32_t ref) { return ((ref >> LEAF_COUNT_SHIFT) & 7u) + 1; }
inline std::uint32_t leaf_texel(std::uint32_t ref) { return ref & LEAF_TEXEL_MASK; }
inline std::uint32_t leaf_ref(std::uint32_t count, std::uint32_t texel) {
  return LEAF_BIT | (count - 1) << LEAF_COUNT_SHIFT | texel;
}

inline DeviceChild paper_child(const glm::uvec4* t) {
  return {{as_vec3(t[0]), {as_float(t[0].w), as_float(t[1].x), as_float(t[1].y)}},
          t[1].z == 0 ? t[1].w : leaf_ref(t[1].z, t[1].w)};
}

/// Returns the smallest float32 box that holds the box [lo, hi].
inline Bounds rounded_outwards(const glm::dvec3& lo, const glm::dvec3& hi) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  Bounds box;
  for (int axis = 0; axis < 3; ++axis) {
    const float a = float(lo[axis]), b = float(hi[axis]);
    box.lo[axis] = double(a) > lo[axis] ? std::nextafter(a, -infinity) : a;
    box.hi[axis] = double(b) < hi[axis] ? std::nextafter(b, infinity) : b;
  }
  return box;
}

/// Returns the smallest float32 box that holds a box given by its centre (as lo) and half extent (as hi).
inline Bounds box_of_centred(const Bounds& centred) {
  const glm::dvec3 centre = centred.lo, half = centred.hi;
  return rounded_outwards(centre - half, centre + half);
}

/// Returns the pair of siblings that starts at this texel. The boxes are measured from bvh.origin.
inline DevicePair decode_pair(const PairTree& bvh, std::uint32_t texel) {
  const glm::uvec4* t = bvh.nodes.data() + texel;
  if (bvh.layout == NodeLayout::Paper) return {paper_child(t), paper_child(t + 2)};
  if (bvh.layout == NodeLayout::Compact) {
    const glm::uvec4 halves = t[2];
    return {{box_of_centred({as_vec3(t[0]), as_vec3(halves)}), t[0].w},
            {box_of_centred({as_vec3(t[1]), as_vec3(halves << 16u)}), t[1].w}};
  }
  DevicePair pair{
      {{{as_float(t[0].x), as_float(t[0].z), as_float(t[2].x)}, {as_float(t[0].y), as_float(t[0].w), as_float(t[2].y)}},
       t[3].x},
      {{{as_float(t[1].x), as_float(t[1].z), as_float(t[2].z)}, {as_float(t[1].y), as_float(t[1].w), as_float(t[2].w)}},
       t[3].y}};
  if (bvh.layout == NodeLayout::Centred)
    for (DeviceChild* child : {&pair.left, &pair.right}) child->box = box_of_centred(child->box);
  return pair;
}

/// As decode_pair(), but with boxes measured from zero and rounded outward.
inline DevicePair decode_pair_from_zero(const PairTree& bvh, std::uint32_t texel) {
  DevicePair pair = decode_pair(bvh, texel);
  const glm::dvec3 origin = bvh.origin;
  for (DeviceChild* child : {&pair.left, &pair.right})
    child->box = rounded_outwards(glm::dvec3(child->box.lo) + origin, glm::dvec3(child->box.hi) + origin);
  return pair;
}

/// Returns the triangle of three texels of a leaf block.
inline Triangle decode_triangle(const glm::uvec4* t) {
  const glm::vec3 x = as_vec3(t[0]), y = as_vec3(t[1]), z = as_vec3(t[2]);
  return {glm::vec3(x[0], y[0], z[0]), glm::vec3(x[1], y[1], z[1]), glm::vec3(x[2], y[2], z[2])};
}

/// Returns the triangle whose texels start at this texel of the leaf array.
inline Triangle decode_triangle(const PairTree& bvh, std::uint32_t texel) {
  return decode_triangle(bvh.leaves.data() + texel);
}

/// Returns the number of that triangle in the scene.
inline std::uint32_t decode_prim(const PairTree& bvh, std::uint32_t texel) { return bvh.leaves[texel].w; }

}  // namespace ballot
