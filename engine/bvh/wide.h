// The tree with up to eight children a node, which packets walk a child a lane.
#pragma once

#include "engine/bvh/device_bvh.h"

namespace ballot {

/// Texels as DeviceBvh's; the format is in shaders/shared/layout.h. Leaves are those of the binary tree, at the same texels
/// of its leaf array.
struct WideBvh {
  std::vector<glm::uvec4> nodes;  // WIDE_NODE_TEXELS each; node 0 is the root; none where the scene is empty
  std::uint32_t depth = 0;        // nodes on the longest path from the root
  std::uint32_t children = 0;     // of all nodes together
};

/// The binary tree collapsed (collapse.h). Throws Error(Work) if there would be too many nodes for a stack entry
/// (WIDE_MAX_NODES).
WideBvh make_wide_bvh(const DeviceBvh& binary);

}  // namespace ballot
