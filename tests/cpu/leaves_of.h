// Collects the leaves of a binary tree. Trees that are made from it must have the same leaves.
#pragma once

#include <map>

#include "engine/tree/formats/pair_decode.h"

namespace ballot {

inline void add_leaves_of(const PairTree& bvh, const DeviceChild& at, std::map<std::uint32_t, Bounds>& out) {
  if (is_leaf(at.ref)) {
    out.emplace(at.ref, at.box);
    return;
  }
  const DevicePair pair = decode_pair(bvh, at.ref);
  add_leaves_of(bvh, pair.left, out);
  add_leaves_of(bvh, pair.right, out);
}

/// Returns the boxes of all leaves by child reference.
inline std::map<std::uint32_t, Bounds> leaves_of(const PairTree& bvh) {
  std::map<std::uint32_t, Bounds> leaves;
  if (bvh.root != END_OF_TREE) add_leaves_of(bvh, {bvh.root_box, bvh.root}, leaves);
  return leaves;
}

}  // namespace ballot
