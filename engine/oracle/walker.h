// The traversal that both oracles share: visits every leaf of the binary tree that a ray may meet. Internal to
// engine/oracle.
//
// A ray may be of any type R with a function `std::optional<double> enter(const R&, const Bounds&, double t_far)`. It
// returns the t at which the ray enters a box, or nothing if the ray surely misses the box in [ray.t_min, t_far].
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

/// Traverses a tree, and keeps its stack for the next ray. Not thread-safe.
class Walker {
 public:
  explicit Walker(const PairTree& bvh) : bvh_(bvh) { stack_.reserve(bvh.depth + 2); }

  /// Calls visit(texel of a triangle) for every triangle of every leaf that the ray may meet in [ray.t_min, t_far],
  /// near boxes first. visit may lower t_far. The traversal ends when visit returns false.
  template <class R, class Visit>
  void walk(const R& ray, const double& t_far, const Visit& visit) {
    stack_.clear();
    if (bvh_.root != END_OF_TREE) stack_.push_back({bvh_.root, ray.t_min});
    while (!stack_.empty()) {
      const Entry entry = stack_.back();
      stack_.pop_back();
      if (entry.near > t_far) continue;
      if (!is_leaf(entry.ref))
        push_children(ray, entry.ref, t_far);
      else if (!visit_leaf(entry.ref, visit))
        return;
    }
  }

 private:
  struct Entry {
    std::uint32_t ref;
    double near;
  };

  template <class Visit>
  bool visit_leaf(std::uint32_t ref, const Visit& visit) {
    std::uint32_t texel = leaf_texel(ref) + LEAF_HEADER_TEXELS;
    for (std::uint32_t i = 0; i < leaf_count(ref); ++i, texel += TRIANGLE_TEXELS)
      if (!visit(texel)) return false;
    return true;
  }

  template <class R>
  void push_children(const R& ray, std::uint32_t ref, double t_far) {
    const DevicePair pair = decode_pair_from_zero(bvh_, ref);
    const std::optional<double> left = enter(ray, pair.left.box, t_far);
    const std::optional<double> right = enter(ray, pair.right.box, t_far);
    const bool right_first = left && right && *right < *left;
    if (left && right_first) stack_.push_back({pair.left.ref, *left});
    if (right) stack_.push_back({pair.right.ref, *right});
    if (left && !right_first) stack_.push_back({pair.left.ref, *left});
  }

  const PairTree& bvh_;
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
