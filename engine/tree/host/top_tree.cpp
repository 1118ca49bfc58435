// The top-level tree: built over the boxes of the instances, and written as the device reads it.
#include <algorithm>
#include <bit>
#include <map>

#include "engine/core/parallel.h"
#include "engine/core/stopwatch.h"
#include "engine/tree/host/build.h"
#include "engine/tree/host/forest.h"

namespace ballot {

namespace {

glm::uvec4 texel(const glm::vec3& v, std::uint32_t w) {
  return {std::bit_cast<std::uint32_t>(v.x), std::bit_cast<std::uint32_t>(v.y), std::bit_cast<std::uint32_t>(v.z), w};
}
glm::uvec4 texel(const glm::vec3& v, float w) { return texel(v, std::bit_cast<std::uint32_t>(w)); }

/// What lies below a leaf of a part of the tree: an instance, or the part of a group.
struct TopLeaf {
  Bounds box;
  float slack;
  std::uint32_t reference;
};

/// A part of the tree: a tree over leaves, whose inner nodes begin at a texel of all.
class TopPart {
 public:
  explicit TopPart(std::vector<TopLeaf> leaves) : leaves_(std::move(leaves)) {
    std::vector<Bounds> boxes;
    for (const TopLeaf& leaf : leaves_) boxes.push_back(leaf.box);
    bvh_ = build_box_bvh(boxes);
    slacks_.resize(bvh_.nodes.size());
    for (std::size_t i = slacks_.size(); i-- > 0;) {  // children come after their parents
      const BvhNode& node = bvh_.nodes[i];
      if (node.count)
        slacks_[i] = leaves_[bvh_.references[node.first]].slack;
      else if (i != 1)
        slacks_[i] = std::max(slacks_[node.first], slacks_[node.first + 1]);
    }
  }
  std::uint32_t depth() const { return bvh_.stats.depth; }
  /// Returns the texels of its inner nodes: pairs of siblings begin at node 2.
  std::uint32_t texels() const {
    return bvh_.nodes.size() < 2 ? 0 : std::uint32_t(bvh_.nodes.size() / 2 - 1) * TOP_NODE_TEXELS;
  }
  void begin_at(std::uint32_t texel) { begin_ = texel; }
  /// Returns the root as a leaf of a part above. It has a leaf.
  TopLeaf root() const { return {{bvh_.nodes[0].lo, bvh_.nodes[0].hi}, slacks_[0], reference(0)}; }
  /// The leaves may get other references before write() and after the tree was built.
  std::vector<TopLeaf>& leaves() { return leaves_; }
  void write(std::vector<glm::uvec4>& to) const {
    for (std::uint32_t left = 2; left + 1 < bvh_.nodes.size(); left += 2)
      for (const std::uint32_t child : {left, left + 1}) {
        to.push_back(texel(bvh_.nodes[child].lo, reference(child)));
        to.push_back(texel(bvh_.nodes[child].hi, slacks_[child]));
      }
  }

 private:
  std::uint32_t reference(std::uint32_t node) const {
    const BvhNode& n = bvh_.nodes[node];
    return n.count ? leaves_[bvh_.references[n.first]].reference : begin_ + (n.first / 2 - 1) * TOP_NODE_TEXELS;
  }

  std::vector<TopLeaf> leaves_;
  Bvh bvh_;
  std::vector<float> slacks_;
  std::uint32_t begin_ = 0;
};

/// Writes the nodes over the instances of groups, in ascending order, and behind them those of each group.
void write_groups(TopTree& top, const std::map<std::uint32_t, std::vector<TopLeaf>>& leaves_of) {
  std::vector<TopPart> parts;
  std::vector<TopLeaf> roots;
  for (const auto& [group, leaves] : leaves_of) {
    parts.emplace_back(leaves);
    roots.push_back(parts.back().root());
    top.groups.push_back({.group = group});
    top.depth = std::max(top.depth, parts.back().depth());
  }
  TopPart above(std::move(roots));
  top.depth += above.depth();
  std::uint32_t begin = above.texels();
  for (std::size_t i = 0; i < parts.size(); ++i) {
    parts[i].begin_at(begin);
    begin += parts[i].texels();
    top.groups[i].root = above.leaves()[i].reference = parts[i].root().reference;
  }
  top.root = above.root().reference;
  above.write(top.texels);
  for (const TopPart& part : parts) part.write(top.texels);
}

void write_record(glm::uvec4* to, const Instance& i) {
  for (int r = 0; r < 3; ++r) *to++ = texel(i.map.row[r], i.map.translation[r]);
  *to++ = texel(i.box.lo, i.mesh);
  *to++ = texel(i.box.hi, i.slack);
  *to = {i.first, std::uint32_t(i.mirrors), 0, 0};
}

/// A child of a node: its box, and the largest slack below it.
struct TopChild {
  Bounds box;
  float slack;
};

glm::vec3 vector_of(const glm::uvec4& t) {
  return {std::bit_cast<float>(t.x), std::bit_cast<float>(t.y), std::bit_cast<float>(t.z)};
}

TopChild child_at(const glm::uvec4* texels) {
  return {{vector_of(texels[0]), vector_of(texels[1])}, std::bit_cast<float>(texels[1].w)};
}

TopChild united_children(const glm::uvec4* node) {
  const TopChild l = child_at(node), r = child_at(node + 2);
  return {{glm::min(l.box.lo, r.box.lo), glm::max(l.box.hi, r.box.hi)}, std::max(l.slack, r.slack)};
}

/// Sets the bounds and the cost: the expected number of nodes, leaves too, that a ray through the bounds meets.
void measure(TopTree& top, std::span<const Instance> instances) {
  if (top.root == END_OF_TREE) return;
  if (top.root & LEAF_BIT) {
    top.bounds = instances[top.root & ~LEAF_BIT].box;
    return;
  }
  top.bounds = united_children(top.texels.data() + top.root).box;
  double sum = 0;
  for (std::uint32_t at = 0; at < top.records; at += 2) {
    const TopChild child = child_at(top.texels.data() + at);
    sum += half_area(child.box.lo, child.box.hi);
  }
  top.cost = 1 + sum / half_area(top.bounds.lo, top.bounds.hi);
}

}  // namespace

TopTree build_top(std::span<const Instance> instances, std::span<const MeshTree> meshes,
                  std::span<const std::uint32_t> groups) {
  const Timer timer;
  std::map<std::uint32_t, std::vector<TopLeaf>> leaves;  // of the instances that can be hit, by their groups
  for (std::uint32_t i = 0; i < instances.size(); ++i) {
    if (meshes[instances[i].mesh].extents.empty) continue;
    leaves[groups.empty() ? kSharedGroup : groups[i]].push_back({instances[i].box, instances[i].slack, LEAF_BIT | i});
  }
  TopTree top;
  top.texels.reserve(instances.size() * (TOP_NODE_TEXELS + INSTANCE_TEXELS));
  if (!leaves.empty()) write_groups(top, leaves);
  if (groups.empty()) top.groups.clear();
  top.records = std::uint32_t(top.texels.size());
  top.texels.resize(top.records + instances.size() * INSTANCE_TEXELS);
  for (std::size_t i = 0; i < instances.size(); ++i)
    write_record(&top.texels[top.records + i * INSTANCE_TEXELS], instances[i]);
  measure(top, instances);
  top.built_cost = top.cost;
  top.build_s = timer.seconds();
  return top;
}

// Nodes follow their parents, so the children of a node are ready before it from the last one on.
void refit_top(TopTree& top, std::span<const Instance> instances) {
  const Timer timer;
  for (std::uint32_t at = top.records; at >= 2;) {
    at -= 2;
    const std::uint32_t reference = top.texels[at].w;
    TopChild child;
    if (reference & LEAF_BIT) {
      const Instance& i = instances[reference & ~LEAF_BIT];
      child = {i.box, i.slack};
    } else {
      child = united_children(&top.texels[reference]);
    }
    top.texels[at] = texel(child.box.lo, reference);
    top.texels[at + 1] = texel(child.box.hi, child.slack);
  }
  for_chunks(instances.size(), 1 << 12, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      write_record(&top.texels[top.records + i * INSTANCE_TEXELS], instances[i]);
  });
  measure(top, instances);
  top.build_s = timer.seconds();
}

}  // namespace ballot
