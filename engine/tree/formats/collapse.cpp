#include "engine/tree/formats/collapse.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/core/error.h"
#include "engine/tree/host/build.h"

namespace ballot {
namespace {

constexpr int kWidest = 8;
constexpr float kLeastSide = 0x1p-62f;  // LEAST_SIDE of shaders/lib/build/area.glsl

/// The best ways to collapse the subtree of a pair of siblings, for each number of children that it may become.
struct Best {
  /// The least summed area of the wide nodes that the subtree takes, in units of about the square of the longest side.
  /// cost[n - 1] with n < width: the subtree becomes at most n children of the node above.
  /// cost[width - 1]: the subtree has a node of its own, whose area is not counted.
  std::array<float, kWidest> cost;
  /// left[n - 1]: how many of n children the left sibling becomes. 0: n - 1 children are as good, or n is 1 and the
  /// child is a node of its own.
  std::array<std::uint8_t, kWidest> left;
};

class Collapse {
 public:
  Collapse(const PairTree& binary, int width)
      : binary_(binary), width_(width), best_(binary.nodes.size() / binary.pair_texels()) {
    const glm::vec3 sides = binary.root_box.hi - binary.root_box.lo;
    unit_ = collapse_unit(std::max({sides.x, sides.y, sides.z}));
    // Children come after their parents, so a pass from the end meets the children first.
    for (std::size_t pair = best_.size(); pair-- > 0;) plan(std::uint32_t(pair) * binary_.pair_texels());
  }

  CollapsedBvh build(std::uint64_t most_nodes) {
    CollapsedBvh out;
    struct Open {
      DeviceChild subtree;  // the subtree that becomes a node
      std::size_t at;       // its index in out.children
      std::uint32_t level;  // of the node; 1 is the root
    };
    constexpr std::size_t kRoot = ~std::size_t{0};
    std::vector<Open> open{{{binary_.root_box, binary_.root}, kRoot, 1}};
    while (!open.empty()) {
      const auto [subtree, at, level] = open.back();
      open.pop_back();
      if (at != kRoot) out.children[at].ref = std::uint32_t(out.ends.size());
      const std::size_t first = out.children.size();
      if (is_leaf(subtree.ref))
        out.children.push_back(subtree);  // the whole scene is one leaf
      else
        gather_pair(subtree.ref, width_, out.children);
      out.depth = std::max(out.depth, level);
      out.ends.push_back(std::uint32_t(out.children.size()));
      for (std::size_t i = out.children.size(); i-- > first;)
        if (!is_leaf(out.children[i].ref)) open.push_back({out.children[i], i, level + 1});
      check_collapsed(out.ends.size(), width_, most_nodes);
    }
    return out;
  }

 private:
  /// Returns the cost of a subtree that becomes at most n children of a node.
  float cost(const DeviceChild& child, int n) const {
    return is_leaf(child.ref) ? 0 : best_[child.ref / binary_.pair_texels()].cost[n - 1];
  }

  /// Fills the Best of the pair at this texel. Those of the pairs below must be filled.
  void plan(std::uint32_t texel) {
    const DevicePair pair = decode_pair(binary_, texel);
    Best& b = best_[texel / binary_.pair_texels()];
    const auto divide = [&](int n) {  // the pair becomes exactly n >= 2 children
      for (int l = 1; l < n; ++l) {
        const float c = cost(pair.left, l) + cost(pair.right, n - l);
        if (l == 1 || c < b.cost[n - 1]) b.cost[n - 1] = c, b.left[n - 1] = std::uint8_t(l);
      }
    };
    divide(width_);
    const float own = b.cost[width_ - 1] + area(pair);  // the pair becomes one child, a node of its own
    for (int n = 2; n < width_; ++n) divide(n);
    b.cost[0] = own;
    b.left[0] = 0;
    for (int n = 2; n < width_; ++n)
      if (b.cost[n - 2] <= b.cost[n - 1]) b.cost[n - 1] = b.cost[n - 2], b.left[n - 1] = 0;
  }

  /// In the arithmetic of the device (shaders/lib/build/area.glsl), so that both choose the same.
  float area(const DevicePair& pair) const {
    glm::vec3 d =
        (glm::max(pair.left.box.hi, pair.right.box.hi) - glm::min(pair.left.box.lo, pair.right.box.lo)) * unit_;
    for (int axis = 0; axis < 3; ++axis)
      if (d[axis] < kLeastSide) d[axis] = 0;
    return d.x * d.y + (d.y * d.z + d.z * d.x);
  }

  /// Appends the children that a subtree becomes if it may become up to n.
  void gather(const DeviceChild& child, int n, std::vector<DeviceChild>& out) const {
    if (is_leaf(child.ref)) {
      out.push_back(child);
      return;
    }
    const Best& b = best_[child.ref / binary_.pair_texels()];
    while (n > 1 && b.left[n - 1] == 0) --n;
    if (n == 1)
      out.push_back(child);
    else
      gather_pair(child.ref, n, out);
  }

  /// Appends the n children that the pair at this texel becomes.
  void gather_pair(std::uint32_t texel, int n, std::vector<DeviceChild>& out) const {
    const DevicePair pair = decode_pair(binary_, texel);
    const int left = best_[texel / binary_.pair_texels()].left[n - 1];
    gather(pair.left, left, out);
    gather(pair.right, n - left, out);
  }

  const PairTree& binary_;
  const int width_;
  float unit_ = 1;  // 1 over the length that areas are measured in the square of
  std::vector<Best> best_;
};

}  // namespace

float collapse_unit(float longest) {
  return longest > 0 ? std::ldexp(1.0f, std::clamp(-std::ilogb(longest), -126, 126)) : 1;
}

void check_collapsed(std::uint64_t nodes, int width, std::uint64_t most_nodes) {
  if (nodes > most_nodes)
    fail(Failure::Work,
         "bvh: a tree of {} children per node has more than {} nodes, which its references cannot number; use another "
         "method",
         width, most_nodes);
}

CollapsedBvh collapse(const PairTree& binary, int width, std::uint64_t most_nodes) {
  if (binary.root == END_OF_TREE) return {};
  return Collapse(binary, width).build(most_nodes);
}

}  // namespace ballot
