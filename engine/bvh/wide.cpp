#include "engine/bvh/wide.h"

#include <algorithm>
#include <array>
#include <limits>

#include "engine/bvh/build.h"
#include "engine/bvh/device_decode.h"
#include "engine/core/error.h"

namespace ballot {
namespace {

using Texel = glm::uvec4;

/// What is best for the subtree below a pair of siblings.
struct Best {
  /// cost[n - 1]: least summed area of the wide nodes in the pair's subtree, if that hangs from the node above by at most
  /// n < 8 children; cost[7]: below a wide node of its own.
  std::array<float, WIDE_CHILDREN> cost;
  /// left[n - 1]: of n children, how many the left sibling becomes; 0: n - 1 children are as good, or one is a wide node.
  std::array<std::uint8_t, WIDE_CHILDREN> left;
};

class Collapse {
 public:
  explicit Collapse(const DeviceBvh& binary) : binary_(binary), best_(binary.nodes.size() / binary.pair_texels()) {
    // Children lie behind their parents, so one pass from the back meets them first.
    for (std::size_t pair = best_.size(); pair-- > 0;) plan(std::uint32_t(pair) * binary_.pair_texels());
  }

  WideBvh build() {
    WideBvh wide;
    struct Open {
      DeviceChild subtree;  // whose wide node this is
      std::uint32_t level;
    };
    std::vector<Open> open{{{binary_.bounds, binary_.root}, 1}};
    for (std::size_t i = 0; i < open.size(); ++i) {
      std::vector<DeviceChild> children;
      const DeviceChild subtree = open[i].subtree;
      if (is_leaf(subtree.ref))
        children.push_back(subtree);  // of a scene that is one leaf
      else
        gather_pair(subtree.ref, WIDE_CHILDREN, children);
      wide.depth = std::max(wide.depth, open[i].level);
      wide.children += std::uint32_t(children.size());
      for (DeviceChild& child : children)
        if (!is_leaf(child.ref)) {
          open.push_back({child, open[i].level + 1});
          child.ref = std::uint32_t(open.size() - 1);
        }
      add_node(children, wide.nodes);
      if (open.size() > WIDE_MAX_NODES)
        fail(Failure::Work,
             "bvh: a tree of 8 children a node has more than {} nodes, which its stack cannot number; use another "
             "method",
             WIDE_MAX_NODES);
    }
    return wide;
  }

 private:
  /// Cost of a subtree as at most n children of a wide node.
  float cost(const DeviceChild& child, int n) const {
    return is_leaf(child.ref) ? 0 : best_[child.ref / binary_.pair_texels()].cost[n - 1];
  }

  void plan(std::uint32_t texel) {
    const DevicePair pair = decode_pair(binary_, texel);
    Best& b = best_[texel / binary_.pair_texels()];
    const auto divide = [&](int n) {  // the pair as exactly n children, two at least
      b.cost[n - 1] = std::numeric_limits<float>::infinity();
      for (int l = 1; l < n; ++l) {
        const float c = cost(pair.left, l) + cost(pair.right, n - l);
        if (c < b.cost[n - 1]) b.cost[n - 1] = c, b.left[n - 1] = std::uint8_t(l);
      }
    };
    divide(WIDE_CHILDREN);
    const float own = b.cost[WIDE_CHILDREN - 1] + float(area(pair));  // one child: a wide node of its own
    for (int n = 2; n < WIDE_CHILDREN; ++n) divide(n);
    b.cost[0] = own;
    b.left[0] = 0;
    for (int n = 2; n < WIDE_CHILDREN; ++n)
      if (b.cost[n - 2] <= b.cost[n - 1]) b.cost[n - 1] = b.cost[n - 2], b.left[n - 1] = 0;
  }

  static double area(const DevicePair& pair) {
    return half_area(glm::min(pair.left.box.lo, pair.right.box.lo), glm::max(pair.left.box.hi, pair.right.box.hi));
  }

  /// The children that a subtree becomes when it may be n.
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

  void gather_pair(std::uint32_t texel, int n, std::vector<DeviceChild>& out) const {
    const DevicePair pair = decode_pair(binary_, texel);
    const int left = best_[texel / binary_.pair_texels()].left[n - 1];
    gather(pair.left, left, out);
    gather(pair.right, n - left, out);
  }

  static void add_node(std::span<const DeviceChild> children, std::vector<Texel>& out) {
    const auto bits = [](float x) { return std::bit_cast<std::uint32_t>(x); };
    constexpr float far = std::numeric_limits<float>::max();
    const DeviceChild none{{glm::vec3(far), glm::vec3(-far)}, END_OF_TREE};
    for (std::size_t i = 0; i < WIDE_CHILDREN; ++i) {
      const DeviceChild& c = i < children.size() ? children[i] : none;
      out.push_back({bits(c.box.lo.x), bits(c.box.lo.y), bits(c.box.lo.z), c.ref});
    }
    for (std::size_t i = 0; i < WIDE_CHILDREN; ++i) {
      const DeviceChild& c = i < children.size() ? children[i] : none;
      out.push_back({bits(c.box.hi.x), bits(c.box.hi.y), bits(c.box.hi.z), 0});
    }
  }

  const DeviceBvh& binary_;
  std::vector<Best> best_;
};

}  // namespace

WideBvh make_wide_bvh(const DeviceBvh& binary) {
  if (binary.root == END_OF_TREE) return {};
  return Collapse(binary).build();
}

}  // namespace ballot
