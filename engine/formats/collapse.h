// A binary tree with nodes of more than two children.
#pragma once

#include "engine/formats/pair_decode.h"

namespace ballot {

struct CollapsedBvh {
  /// All nodes' children, node by node, parents before children; `ref` of a child is a leaf, as in the binary tree, or the number
  /// of a node. Node 0 is the root. No nodes where the scene is empty.
  std::vector<DeviceChild> children;
  std::vector<std::uint32_t> ends;  // of each node: where its children end, and the next node's begin
  std::uint32_t depth = 0;          // nodes on the longest path from the root

  std::span<const DeviceChild> children_of(std::size_t node) const {
    const std::uint32_t first = node == 0 ? 0 : ends[node - 1];
    return std::span(children).subspan(first, ends[node] - first);
  }
};

/// Nodes of up to `width` children, 2 to 8, so that the expected number of nodes that a random ray meets is least. Throws
/// Error(Work) beyond `most_nodes`.
///
/// Source: Henri Ylitie, Tero Karras, Samuli Laine. Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide
/// BVHs. HPG 2017, section 3.1. Differs: leaves are kept as they are, so triangles cost the same in every tree and drop out.
CollapsedBvh collapse(const PairTree& binary, int width, std::uint64_t most_nodes);

}  // namespace ballot
