// Reads a tree that was built on the device back in the reference form.
#include <chrono>

#include "engine/bvh/build.h"
#include "engine/core/error.h"
#include "engine/formats/pair_decode.h"
#include "engine/tree/build/device_builder.h"

namespace ballot {

namespace {

/// Converts the device tree to the reference form, depth first and left child first, as flatten() does.
class ReadBack {
 public:
  explicit ReadBack(const PairTree& tree) : tree_(tree) {}

  Bvh run() {
    if (tree_.root == END_OF_TREE) return {};
    bvh_.nodes.resize(2);
    place(0, {tree_.bounds, tree_.root}, 0);
    while (!todo_.empty()) {
      const Open open = todo_.back();
      todo_.pop_back();
      if (open.texel + tree_.pair_texels() > tree_.nodes.size() || bvh_.nodes.size() > 2 * tree_.nodes.size())
        fail(Failure::Work, "bvh: the tree that the device built refers to a pair that it does not have");
      const std::uint32_t first = std::uint32_t(bvh_.nodes.size());
      bvh_.nodes.resize(first + 2);
      bvh_.nodes[open.node].first = first;
      const DevicePair pair = decode_pair(tree_, open.texel);
      place(first + 1, pair.right, open.inner_above + 1);
      place(first, pair.left, open.inner_above + 1);
    }
    return std::move(bvh_);
  }

 private:
  struct Open {
    std::uint32_t node, texel;
    std::uint32_t inner_above;  // inner nodes on the path from the root, without this one
  };

  void place(std::uint32_t at, const DeviceChild& child, std::uint32_t inner_above) {
    const glm::vec3 origin = at == 0 ? glm::vec3(0) : tree_.origin;  // the sums are exact: box_origin()
    BvhNode& node = bvh_.nodes[at];
    node = {child.box.lo + origin, child.box.hi + origin, 0, 0};
    if (!is_leaf(child.ref)) {
      todo_.push_back({at, child.ref, inner_above});
      return;
    }
    bvh_.stats.depth = std::max(bvh_.stats.depth, inner_above);
    node.count = leaf_count(child.ref);
    node.first = std::uint32_t(bvh_.references.size());
    const std::uint32_t block = leaf_texel(child.ref);
    if (std::uint64_t{block} + LEAF_HEADER_TEXELS + node.count * TRIANGLE_TEXELS > tree_.leaves.size())
      fail(Failure::Work, "bvh: the tree that the device built refers to a leaf that it does not have");
    for (std::uint32_t i = 0; i < node.count; ++i)
      bvh_.references.push_back(decode_prim(tree_, block + LEAF_HEADER_TEXELS + i * TRIANGLE_TEXELS));
    ++bvh_.stats.leaves;
    bvh_.stats.largest_leaf = std::max(bvh_.stats.largest_leaf, node.count);
  }

  const PairTree& tree_;
  Bvh bvh_;
  std::vector<Open> todo_;
};

PairTree download(Context& gpu, DeviceBuilder& builder, const BuiltTree& built) {
  PairTree tree;
  tree.layout = NodeLayout::Interleaved;
  tree.root = built.root;
  tree.depth = built.depth;
  tree.bounds = built.bounds;
  tree.origin = built.origin;
  Buffer<glm::uvec4> pairs(gpu, std::size_t(built.pairs) * tree.pair_texels(), Access::Storage, "bvh nodes");
  Buffer<glm::uvec4> leaves(gpu, built.leaf_texels, Access::Storage, "bvh leaves");
  builder.write(NodeLayout::Interleaved, Padding::Ray, pairs, leaves);
  tree.nodes.resize(pairs.size());
  tree.leaves.resize(leaves.size());
  pairs.download(tree.nodes);
  leaves.download(tree.leaves);
  return tree;
}

}  // namespace

Bvh build_bvh_on_device(Context& gpu, std::span<const Triangle> triangles, const BuildSettings& settings) {
  const auto start = std::chrono::steady_clock::now();
  check_settings(settings);
  check_triangles(triangles);
  DeviceBuilder builder(gpu);
  const Buffer<Triangle> buffer = DeviceBuilder::upload(gpu, triangles);
  const BuiltTree& built = builder.build(buffer, std::uint32_t(triangles.size()), settings);
  Bvh bvh;
  if (built.root != END_OF_TREE) bvh = ReadBack(download(gpu, builder, built)).run();
  bvh.bounds = built.bounds;
  BvhStats& s = bvh.stats;
  s.triangles = std::uint32_t(triangles.size());
  s.degenerate = s.triangles - built.proper;
  s.references = std::uint32_t(bvh.references.size());
  s.nodes = bvh.nodes.empty() ? 0 : std::uint32_t(bvh.nodes.size() - 1);
  s.bytes = bvh.nodes.size() * sizeof(BvhNode) + bvh.references.size() * sizeof(std::uint32_t);
  s.sah = bvh.nodes.empty() ? 0 : sah_cost(bvh, settings);
  s.builder = BuilderId::Device;
  s.build_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return bvh;
}

}  // namespace ballot
