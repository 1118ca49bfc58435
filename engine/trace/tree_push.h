// The push constants that tell a kernel of the tree that it walks.
#pragma once

#include "engine/tree/device_tree.h"
#include "shaders/shared/layout.h"

namespace ballot {

/// Writes the address of an array in halves; an array that is null leaves them as they are.
inline void push_address(const DeviceTree::Texels* texels, std::uint32_t& lo, std::uint32_t& hi) {
  if (!texels) return;
  lo = std::uint32_t(texels->address());
  hi = std::uint32_t(texels->address() >> 32);
}

/// Returns push constants of a tree whose walk begins at child reference `root`, and of the arrays that a kernel reads;
/// null for an array that it does not. The rays are left to the caller.
inline TracePush push_of(const DeviceTree& tree, std::uint32_t root, const DeviceTree::Texels* nodes,
                         const DeviceTree::Texels* format, const DeviceTree::Texels* leaves) {
  TracePush push{};
  push.scene_lo = tree.bvh().bounds.lo;
  push.scene_hi = tree.bvh().bounds.hi;
  push.box_origin = tree.box_origin();
  push.padded_reach = tree.padded_reach();
  push.shear_scale = tree.shear().scale;
  push.shear_near = tree.shear().near;
  push.root = root;
  push_address(nodes, push.nodes_lo, push.nodes_hi);
  push_address(format, push.format_lo, push.format_hi);
  push_address(leaves, push.leaves_lo, push.leaves_hi);
  return push;
}

}  // namespace ballot
