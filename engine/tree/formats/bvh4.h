// The four-wide tree: up to four children per node, in 64 bytes. Each ray traverses it alone, without a packet.
#pragma once

#include "engine/tree/formats/pair.h"

namespace ballot {

/// The four-wide tree on the device, in texels of 16 bytes like PairTree's. The format is in shaders/shared/layout.h.
/// Its leaves are those of the binary tree, at the same texels of the leaf array.
struct Bvh4Tree {
  std::vector<glm::uvec4> nodes;  // BVH4_NODE_TEXELS texels per node, the root first; none if the root is no node
  /// Child reference of the root: texel 0, or as the binary tree's root if that is a leaf or END_OF_TREE.
  std::uint32_t root = END_OF_TREE;
  std::uint32_t depth = 0;     // nodes on the longest path from the root
  std::uint32_t children = 0;  // of all nodes together, empty slots not counted
};

/// The most nodes that child references can number.
constexpr std::uint64_t kBvh4MostNodes = LEAF_BIT / BVH4_NODE_TEXELS;

/// Collapses the binary tree (collapse.h) and quantises the box of each child to a grid of 255 steps over the box of
/// its node. Boxes are rounded outward: in exact arithmetic the quantised box holds the child's own box.
///
/// Source: Holger Dammertz, Johannes Hanika, Alexander Keller. Shallow Bounding Volume Hierarchies for Fast SIMD Ray
/// Tracing of Incoherent Rays. EGSR 2008 (four children per node); Ylitie et al. 2017 (the grid). Differs: a step may
/// have any size, not only a power of two, so that the grid fits its node.
///
/// Throws Error(Work) if the tree has more nodes than a child reference can number.
Bvh4Tree encode_bvh4(const PairTree& binary);

}  // namespace ballot
