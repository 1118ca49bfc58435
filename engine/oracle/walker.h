// The traversal that all oracles share: visits every leaf of a binary tree that a ray may meet. Internal to
// engine/oracle.
//
// A ray may be of any type R with a function `std::optional<double> enter(const R&, const Bounds&, double t_far)`. It
// returns the t at which the ray enters a box, or nothing if the ray surely misses the box in [ray.t_min, t_far]. A
// point is such a ray too, whose t are squares of distances. Trees are those of the device, whose leaves hold texels of
// triangles, and those of the reference form, whose leaves hold references.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "engine/tree/formats/pair_decode.h"

namespace ballot {

/// Cuts [near, far] to the t at which a ray is in a box that `pad` widens. Returns false if the ray is parallel to a
/// side and beyond it.
template <class R>
bool cut_to_box(const R& ray, const Bounds& box, const double (&pad)[3], double& near, double& far) {
  for (int k = 0; k < 3; ++k) {
    const double lo = box.lo[k] - pad[k] - ray.o[k], hi = box.hi[k] + pad[k] - ray.o[k];
    if (ray.d[k] == 0) {
      if (lo > 0 || hi < 0) return false;
      continue;
    }
    const double a = lo * ray.inverse_d[k], b = hi * ray.inverse_d[k];
    near = std::max(near, std::min(a, b));
    far = std::min(far, std::max(a, b));
  }
  return true;
}

/// Two siblings, with what the tree itself calls them.
inline DevicePair children_of(const PairTree& tree, std::uint32_t ref) { return decode_pair_from_zero(tree, ref); }
inline DevicePair children_of(const Bvh& tree, std::uint32_t node) {
  const std::uint32_t left = tree.nodes[node].first;
  const auto child = [&](std::uint32_t i) { return DeviceChild{{tree.nodes[i].lo, tree.nodes[i].hi}, i}; };
  return {child(left), child(left + 1)};
}

inline std::uint32_t root_of(const PairTree& tree) { return tree.root; }
inline std::uint32_t root_of(const Bvh& tree) { return tree.nodes.empty() ? END_OF_TREE : 0; }
inline std::uint32_t depth_of(const PairTree& tree) { return tree.depth; }
inline std::uint32_t depth_of(const Bvh& tree) { return tree.stats.depth; }
inline bool is_leaf(const PairTree&, std::uint32_t ref) { return is_leaf(ref); }
inline bool is_leaf(const Bvh& tree, std::uint32_t node) { return tree.nodes[node].count > 0; }

/// Call visit for all that a leaf holds, until it returns false.
template <class Visit>
bool visit_leaf(const PairTree&, std::uint32_t ref, const Visit& visit) {
  std::uint32_t texel = leaf_texel(ref) + LEAF_HEADER_TEXELS;
  for (std::uint32_t i = 0; i < leaf_count(ref); ++i, texel += TRIANGLE_TEXELS)
    if (!visit(texel)) return false;
  return true;
}
template <class Visit>
bool visit_leaf(const Bvh& tree, std::uint32_t node, const Visit& visit) {
  const BvhNode& leaf = tree.nodes[node];
  for (std::uint32_t i = 0; i < leaf.count; ++i)
    if (!visit(tree.references[leaf.first + i])) return false;
  return true;
}

/// Traverses a tree, a PairTree or a Bvh, and keeps its stack for the next ray. Not thread-safe.
template <class Tree>
class Walker {
 public:
  explicit Walker(const Tree& tree) : tree_(tree) { stack_.reserve(depth_of(tree) + 2); }

  /// Calls visit(texel of a triangle, or reference) for all that is in leaves that the ray may meet in
  /// [ray.t_min, t_far], near boxes first. visit may lower t_far. The traversal ends when visit returns false.
  template <class R, class Visit>
  void walk(const R& ray, const double& t_far, const Visit& visit) {
    stack_.clear();
    if (root_of(tree_) != END_OF_TREE) stack_.push_back({root_of(tree_), ray.t_min});
    while (!stack_.empty()) {
      const Entry entry = stack_.back();
      stack_.pop_back();
      if (entry.near > t_far) continue;
      if (!is_leaf(tree_, entry.ref))
        push_children(ray, entry.ref, t_far);
      else if (!visit_leaf(tree_, entry.ref, visit))
        return;
    }
  }

 private:
  struct Entry {
    std::uint32_t ref;
    double near;
  };

  template <class R>
  void push_children(const R& ray, std::uint32_t ref, double t_far) {
    const DevicePair pair = children_of(tree_, ref);
    const std::optional<double> left = enter(ray, pair.left.box, t_far);
    const std::optional<double> right = enter(ray, pair.right.box, t_far);
    const bool right_first = left && right && *right < *left;
    if (left && right_first) stack_.push_back({pair.left.ref, *left});
    if (right) stack_.push_back({pair.right.ref, *right});
    if (left && !right_first) stack_.push_back({pair.left.ref, *left});
  }

  const Tree& tree_;
  std::vector<Entry> stack_;
};

/// Calls visit(texel of a triangle) for every triangle of every leaf block, in order.
template <class Visit>
void for_all_triangles(const PairTree& bvh, const Visit& visit) {
  for (std::uint32_t block = 0; block < bvh.leaves.size();) {
    const std::uint32_t count = bvh.leaves[block].w;
    block += LEAF_HEADER_TEXELS;
    for (std::uint32_t i = 0; i < count; ++i, block += TRIANGLE_TEXELS) visit(block);
  }
}

}  // namespace ballot
