// Declarations that the parts of the builder share: the binary tree that Embree's callbacks make, clipping and
// flattening. Internal to engine/tree/host.
#pragma once

#include <glm/common.hpp>
#include <span>

#include "engine/core/exact_area.h"
#include "engine/tree/host/bvh.h"

namespace ballot {

/// A node of the builder's binary tree. It lives in the builder's memory. The tree may have any depth: no code recurses
/// over it.
struct BuildNode {
  Bounds box;               // leaf: covers its references; inner node: not used, as flatten() unites the children
  std::uint32_t count = 0;  // leaf: number of references, 1..MAX_LEAF_TRIANGLES; inner node: 0
  union {
    const BuildNode* child[2];
    std::uint32_t prims[MAX_LEAF_TRIANGLES];
  };
  BuildNode() : child{nullptr, nullptr} {}
};

/// Converts the tree to the reference form, depth first and left child first. Fills the bounds and all statistics but
/// triangles, degenerate and build_s. A null `root` is an empty tree. Throws Error(Work) beyond 2^31 nodes or
/// references.
Bvh flatten(const BuildNode* root, const BuildSettings& settings);

/// Sets the box of each inner node to the union of its children's. Children come after their parent in the array, so a
/// pass from the end meets both children first.
void unite_children(std::vector<BvhNode>& nodes);

/// Returns the SAH cost of a tree that has nodes, as BvhStats::sah.
double sah_cost(const Bvh& bvh, const BuildSettings& settings);

// The triangle test multiplies three lengths. Their product must stay in the range of float32.
constexpr float kLargestVertex = 1e12f;

/// Throw Error(Arguments) or Error(Work) as build_bvh() does for settings out of range and for triangles that no
/// builder takes.
void check_settings(const BuildSettings& settings);
void check_triangles(std::span<const Triangle> triangles);

/// True if the triangle has no area, without rounding: its vertices lie on a line or at one point.
inline bool is_degenerate(const Triangle& t) { return has_no_area(t[0], t[1], t[2]); }

inline Bounds bounds_of(const Triangle& t) {
  return {glm::min(t[0], glm::min(t[1], t[2])), glm::max(t[0], glm::max(t[1], t[2]))};
}

/// Builds a tree over boxes, one to a leaf, by the builder `balanced`. References are numbers of boxes, whose
/// coordinates must be finite. Throws Error(Work) if memory runs out or Embree fails.
Bvh build_box_bvh(std::span<const Bounds> boxes);

/// Returns half the surface area of a box. Double precision keeps the areas of very large and very small boxes in
/// range.
inline double half_area(const glm::vec3& lo, const glm::vec3& hi) {
  const glm::dvec3 size = glm::dvec3(hi) - glm::dvec3(lo);
  return size.x * size.y + size.y * size.z + size.z * size.x;
}

/// The boxes of the two parts of a reference that a plane splits.
struct SplitBoxes {
  Bounds left, right;
};

/// Splits a reference at a plane. Returns the boxes of the two parts of triangle ∩ box. Each box is rounded outward,
/// but never exceeds `box` and never crosses the plane. Together they cover triangle ∩ box. No box is inverted.
SplitBoxes split_reference(const Triangle& triangle, const Bounds& box, int axis, float position);

}  // namespace ballot
