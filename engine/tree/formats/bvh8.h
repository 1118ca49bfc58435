// The compressed eight-wide tree: up to eight children per node, in 80 bytes. Each ray traverses it alone, without a
// packet.
#pragma once

#include "engine/tree/formats/pair.h"

namespace ballot {

/// The compressed eight-wide tree on the device, in texels of 16 bytes like PairTree's. The format is in
/// shaders/shared/layout.h. Its leaves are those of the binary tree, at the same texels of the leaf array.
struct Bvh8Tree {
  std::vector<glm::uvec4> texels;  // BVH8_NODE_TEXELS texels per node, node 0 is the root; then the lists of leaves
  std::uint32_t nodes = 0;         // 0 if the scene is empty
  std::uint32_t depth = 0;         // nodes on the longest path from the root
  std::uint32_t children = 0;      // of all nodes together, empty slots not counted
};

/// The most nodes that nodes can number, if each has the longest list.
constexpr std::uint64_t kBvh8MostNodes = BVH8_MAX_TEXELS / (BVH8_NODE_TEXELS + BVH8_CHILDREN / 4);

/// Collapses the binary tree (collapse.h) and quantises the box of each child to a grid of 255 steps over the box of
/// its node. Boxes are widened by 2^-20 of the node's extent, for the rounding of the box test
/// (shaders/lib/tree/bvh8.glsl), and rounded outward: in exact arithmetic the quantised box holds the widened one.
///
/// The children lie in the slots of their node such that a ray that visits the slots in the order of slot XOR octant
/// of its direction meets near children before far ones: the sum over the children of the dot product of their
/// centres, measured from the node's, with the diagonal of their slot is the largest that any placement has.
///
/// Source: Henri Ylitie, Tero Karras, Samuli Laine. Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide
/// BVHs. HPG 2017. Differs: a step of the grid may have any size, not only a power of two; leaves are those of the
/// binary tree, with a reference each; slots are found by the best placement instead of an auction.
///
/// Throws Error(Work) if the tree has more than kBvh8MostNodes nodes.
Bvh8Tree encode_bvh8(const PairTree& binary);

}  // namespace ballot
