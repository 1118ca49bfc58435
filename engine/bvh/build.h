// What the parts of the builder share: the tree as Embree's callbacks leave it, clipping, flattening. Internal to bvh/.
#pragma once

#include <span>

#include "engine/bvh/bvh.h"

namespace ballot {

/// A node of the builder's binary tree; lives in the builder's memory. Any depth: nothing here recurses.
struct BuildNode {
  Bounds box;               // leaf: covers its references. Inner node: not used, flatten unites the children
  std::uint32_t count = 0;  // leaf: 1..MAX_LEAF_TRIANGLES references. Inner node: 0
  union {
    const BuildNode* child[2];
    std::uint32_t prims[MAX_LEAF_TRIANGLES];
  };
  BuildNode() : child{nullptr, nullptr} {}
};

/// Lays the tree out in the reference form, depth first, left child first, and fills bounds and stats except triangles,
/// degenerate and build_s. `root` may be null: an empty tree. Throws Error(Work) beyond 2^31 nodes or references.
Bvh flatten(const BuildNode* root, const BuildSettings& settings);

/// Zero area: two equal vertices, or a cross product of the edges that is exactly zero in double precision.
bool is_degenerate(const Triangle& triangle);

Bounds bounds_of(const Triangle& triangle);

/// Half the surface area, in double precision, so that neither large nor small boxes leave its range.
double half_area(const glm::vec3& lo, const glm::vec3& hi);

struct SplitBoxes {
  Bounds left, right;
};

/// Splits a reference: boxes of the parts of triangle ∩ box on both sides of a plane. Each is rounded outward but never
/// exceeds `box` or crosses the plane, so that together they cover triangle ∩ box. Never inverted.
SplitBoxes split_reference(const Triangle& triangle, const Bounds& box, int axis, float position);

}  // namespace ballot
