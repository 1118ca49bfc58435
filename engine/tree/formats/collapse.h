// Collapses a binary tree into one whose nodes have more than two children.
#pragma once

#include "engine/tree/formats/pair_decode.h"

namespace ballot {

/// A tree with up to 8 children per node.
struct CollapsedBvh {
  /// The children of all nodes, node by node, parents before children. `ref` of a child is either a leaf, as in the
  /// binary tree, or the number of a node. Node 0 is the root. An empty scene has no nodes.
  std::vector<DeviceChild> children;
  std::vector<std::uint32_t> ends;  // of each node: the end of its children, where the children of the next node begin
  std::uint32_t depth = 0;          // nodes on the longest path from the root

  std::span<const DeviceChild> children_of(std::size_t node) const {
    const std::uint32_t first = node == 0 ? 0 : ends[node - 1];
    return std::span(children).subspan(first, ends[node] - first);
  }
};

/// Collapses a binary tree into nodes of up to `width` children, 2 to 8, such that the expected number of nodes that a
/// random ray meets is least. Throws Error(Work) if there are more than `most_nodes` nodes.
///
/// Source: Henri Ylitie, Tero Karras, Samuli Laine. Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide
/// BVHs. HPG 2017, section 3.1. Differs: leaves are kept as they are, so the cost of triangles is the same for
/// every tree and drops out of the sum.
CollapsedBvh collapse(const PairTree& binary, int width, std::uint64_t most_nodes);

/// Returns 1 over a power of two near the longest side of a scene. Areas that are measured in units of its square stay
/// in the range of float32, and are rounded as without units.
float collapse_unit(float longest);

/// Throws Error(Work) if a tree of nodes with up to `width` children has more than `most_nodes` of them.
void check_collapsed(std::uint64_t nodes, int width, std::uint64_t most_nodes);

}  // namespace ballot
