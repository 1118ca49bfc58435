// The tree with up to four children a node in 64 bytes, which rays walk by themselves.
#pragma once

#include "engine/formats/pair.h"

namespace ballot {

/// Texels as PairTree's; the format is in shaders/shared/layout.h. Leaves are those of the binary tree, at the same texels
/// of its leaf array.
struct Bvh4Tree {
  std::vector<glm::uvec4> nodes;     // BVH4_NODE_TEXELS each; the root comes first; none where the scene is empty
  std::uint32_t root = END_OF_TREE;  // child reference: texel 0, or as the binary tree's where that is no node
  std::uint32_t depth = 0;           // nodes on the longest path from the root
  std::uint32_t children = 0;        // of all nodes together
};

/// The binary tree collapsed (collapse.h), with boxes on a grid of 255 steps over their node's, rounded outward: the box that a
/// node stands for, in exact arithmetic, holds the child's.
///
/// Source: Holger Dammertz, Johannes Hanika, Alexander Keller. Shallow Bounding Volume Hierarchies for Fast SIMD Ray Tracing of
/// Incoherent Rays. EGSR 2008 (four children a node); Ylitie et al. 2017 (the grid). Differs: steps of any size, not powers of
/// two, so that the grid fits its node.
///
/// Throws Error(Work) if there would be too many nodes for a child reference.
Bvh4Tree encode_bvh4(const PairTree& binary);

}  // namespace ballot
