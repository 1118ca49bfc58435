// The top-level tree: built over the boxes of the instances, and written as the device reads it.
#include <algorithm>
#include <bit>

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

/// Returns the largest slack below each node.
std::vector<float> slacks_of(const Bvh& bvh, std::span<const std::uint32_t> used, std::span<const Instance> instances) {
  std::vector<float> slacks(bvh.nodes.size());
  for (std::size_t i = slacks.size(); i-- > 0;) {  // children come after their parents
    const BvhNode& node = bvh.nodes[i];
    if (node.count)
      slacks[i] = instances[used[bvh.references[node.first]]].slack;
    else if (i != 1)
      slacks[i] = std::max(slacks[node.first], slacks[node.first + 1]);
  }
  return slacks;
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

TopTree build_top(std::span<const Instance> instances, std::span<const MeshTree> meshes) {
  const Timer timer;
  std::vector<std::uint32_t> used;  // numbers of the instances that can be hit
  std::vector<Bounds> boxes;
  for (std::uint32_t i = 0; i < instances.size(); ++i) {
    if (meshes[instances[i].mesh].extents.empty) continue;
    used.push_back(i);
    boxes.push_back(instances[i].box);
  }
  const Bvh bvh = build_box_bvh(boxes);
  const std::vector<float> slacks = slacks_of(bvh, used, instances);
  TopTree top;
  top.depth = bvh.stats.depth;
  const auto reference = [&](std::uint32_t node) {
    const BvhNode& n = bvh.nodes[node];
    // Pairs of siblings begin at node 2.
    return n.count ? LEAF_BIT | used[bvh.references[n.first]] : (n.first / 2 - 1) * TOP_NODE_TEXELS;
  };
  top.texels.reserve(bvh.nodes.size() * TOP_NODE_TEXELS / 2 + instances.size() * INSTANCE_TEXELS);
  for (std::uint32_t left = 2; left + 1 < bvh.nodes.size(); left += 2)
    for (const std::uint32_t child : {left, left + 1}) {
      top.texels.push_back(texel(bvh.nodes[child].lo, reference(child)));
      top.texels.push_back(texel(bvh.nodes[child].hi, slacks[child]));
    }
  if (!bvh.nodes.empty()) top.root = reference(0);
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
