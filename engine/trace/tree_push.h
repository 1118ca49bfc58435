// Push constants that describe a tree to the kernel that traverses it.
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

/// Returns the push constants for a traversal of `tree` that starts at child reference `root`. `nodes`, `format` and
/// `leaves` are the arrays that the kernel reads; null for one that it does not read. The caller sets the rest: rays,
/// batches, threshold, camera.
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
