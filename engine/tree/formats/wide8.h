// The eight-wide tree: up to eight children per node. A packet tests one child per lane.
#pragma once

#include "engine/tree/formats/pair.h"

namespace ballot {

/// The eight-wide tree on the device, in texels of 16 bytes like PairTree's. The format is in shaders/shared/layout.h.
/// Its leaves are those of the binary tree, at the same texels of the leaf array.
struct Wide8Tree {
  std::vector<glm::uvec4> nodes;  // WIDE8_NODE_TEXELS texels per node; node 0 is the root; empty if the scene is
  std::uint32_t depth = 0;        // nodes on the longest path from the root
  std::uint32_t children = 0;     // of all nodes together, empty slots not counted
};

/// Collapses the binary tree (collapse.h). Throws Error(Work) if there are more nodes than a stack entry can number
/// (WIDE8_MAX_NODES).
Wide8Tree encode_wide8(const PairTree& binary);

}  // namespace ballot
