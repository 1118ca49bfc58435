// The tree with up to eight children a node, which packets walk a child a lane.
#pragma once

#include "engine/formats/pair.h"

namespace ballot {

/// Texels as PairTree's; the format is in shaders/shared/layout.h. Leaves are those of the binary tree, at the same texels
/// of its leaf array.
struct Wide8Tree {
  std::vector<glm::uvec4> nodes;  // WIDE8_NODE_TEXELS each; node 0 is the root; none where the scene is empty
  std::uint32_t depth = 0;        // nodes on the longest path from the root
  std::uint32_t children = 0;     // of all nodes together
};

/// The binary tree collapsed (collapse.h). Throws Error(Work) if there would be too many nodes for a stack entry
/// (WIDE8_MAX_NODES).
Wide8Tree encode_wide8(const PairTree& binary);

}  // namespace ballot
