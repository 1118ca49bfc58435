// The top-level tree: built over the boxes of the instances, and written as the device reads it.
#include <algorithm>
#include <bit>
#include <chrono>

#include "engine/bvh/build.h"
#include "engine/bvh/forest.h"

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

void add_record(std::vector<glm::uvec4>& texels, const Instance& i) {
  for (int r = 0; r < 3; ++r) texels.push_back(texel(i.map.row[r], i.map.translation[r]));
  texels.push_back(texel(i.box.lo, i.mesh));
  texels.push_back(texel(i.box.hi, i.slack));
  texels.push_back({i.first, 0, 0, 0});
}

}  // namespace

TopTree build_top(std::span<const Instance> instances, std::span<const MeshTree> meshes) {
  const auto start = std::chrono::steady_clock::now();
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
  top.bounds = bvh.bounds;
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
  for (const Instance& i : instances) add_record(top.texels, i);
  top.build_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return top;
}

}  // namespace ballot
