#include "engine/tree/formats/bvh4.h"

#include "engine/tree/formats/collapse.h"
#include "shaders/shared/grid.h"

namespace ballot {
namespace {

void add_bvh4_node(std::span<const DeviceChild> children, std::vector<glm::uvec4>& out) {
  Bounds all = children[0].box;
  for (const DeviceChild& c : children) all = {glm::min(all.lo, c.box.lo), glm::max(all.hi, c.box.hi)};
  glm::uvec4 first{}, lower{}, upper{}, refs{};
  for (int axis = 0; axis < 3; ++axis) {
    const float from = all.lo[axis], step = grid_step(from, all.hi[axis]);
    first[axis] = std::bit_cast<std::uint32_t>(from);
    (axis == 0 ? first : axis == 1 ? lower : upper).w = std::bit_cast<std::uint32_t>(step);
    for (std::uint32_t i = 0; i < BVH4_CHILDREN; ++i) {
      const bool none = i >= children.size();
      lower[axis] |= (none ? GRID_STEPS : grid_below(from, step, children[i].box.lo[axis])) << 8 * i;
      upper[axis] |= (none ? 0 : grid_above(from, step, children[i].box.hi[axis])) << 8 * i;
    }
  }
  for (std::size_t i = 0; i < BVH4_CHILDREN; ++i) {
    const std::uint32_t ref = i < children.size() ? children[i].ref : END_OF_TREE;
    refs[int(i)] = is_leaf(ref) ? ref : ref * BVH4_NODE_TEXELS;
  }
  out.insert(out.end(), {first, lower, upper, refs});
}

}  // namespace

Bvh4Tree encode_bvh4(const PairTree& binary) {
  Bvh4Tree out;
  out.root = binary.root;
  if (binary.root == END_OF_TREE || is_leaf(binary.root)) return out;
  const CollapsedBvh tree = collapse(binary, BVH4_CHILDREN, kBvh4MostNodes);
  out.depth = tree.depth;
  out.children = std::uint32_t(tree.children.size());
  out.nodes.reserve(tree.ends.size() * BVH4_NODE_TEXELS);
  for (std::size_t i = 0; i < tree.ends.size(); ++i) add_bvh4_node(tree.children_of(i), out.nodes);
  return out;
}

}  // namespace ballot
