// Builds the tree of triangles, and reads it back in the reference form.

#include "engine/tree/device/device_build.h"
#include "engine/core/error.h"
#include "engine/core/stopwatch.h"
#include "engine/tree/formats/pair_decode.h"
#include "engine/tree/host/build.h"

namespace ballot {

namespace {

/// Converts the device tree to the reference form, depth first and left child first, as flatten() does.
class ReadBack {
 public:
  explicit ReadBack(PairTree tree) : tree_(std::move(tree)) {}

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

  const PairTree tree_;
  Bvh bvh_;
  std::vector<Open> todo_;
};

}  // namespace

DeviceBuild::DeviceBuild(Context& gpu, std::span<const Triangle> triangles, const BuildSettings& settings)
    : gpu_(gpu), settings_(settings), builder_(gpu) {
  check_settings(settings);
  build(triangles);
}

DeviceBuild::DeviceBuild(Context& gpu, Buffer<Triangle> triangles, const BuildSettings& settings)
    : gpu_(gpu), settings_(settings), builder_(gpu), triangles_(std::move(triangles)) {
  check_settings(settings);
  DeviceBuilder::check_count(gpu.info(), triangles_->size());
  rebuild();
}

void DeviceBuild::build(std::span<const Triangle> triangles) {
  const Timer timer;
  check_triangles(triangles);
  DeviceBuilder::check_count(gpu_.info(), triangles.size());
  triangles_ = DeviceBuilder::upload(gpu_, triangles);
  build_at_hand();
  summary_.stats.build_s = timer.seconds();
}

void DeviceBuild::rebuild() {
  const Timer timer;
  build_at_hand();
  summary_.stats.build_s = timer.seconds();
}

void DeviceBuild::build_at_hand() {
  built_ = builder_.build(*triangles_, std::uint32_t(triangles_->size()), settings_);
  bvh_.reset();
  summary_ = {};
  summary_.bounds = built_.bounds;
  BvhStats& s = summary_.stats;
  s.triangles = built_.triangles;
  s.degenerate = built_.triangles - built_.proper;
  s.references = built_.proper;
  s.leaves = built_.leaves();
  s.nodes = s.leaves == 0 ? 0 : 2 * s.leaves - 1;
  s.depth = built_.depth;
  s.largest_leaf = std::min(settings_.max_leaf, built_.proper);
  s.sah = built_.sah;
  s.bytes = s.leaves * 2 * sizeof(BvhNode) + s.references * sizeof(std::uint32_t);
  s.builder = BuilderId::Device;
}

void DeviceBuild::begin_refit(const Bounds& bounds) {
  const glm::vec3 sides = bounds.hi - bounds.lo;
  builder_.begin_refit(*triangles_, std::max({sides.x, sides.y, sides.z}));
}

bool DeviceBuild::end_refit() {
  if (!builder_.end_refit()) return false;
  built_ = builder_.built();
  bvh_.reset();
  summary_.bounds = built_.bounds;
  summary_.stats.sah = built_.sah;
  return has_box_origin();
}

WideEncoder& DeviceBuild::encoder(TreeFormatId id) { return encoders_.try_emplace(id, gpu_, id).first->second; }

WideShape DeviceBuild::collapse(TreeFormatId id, const BufferPart& pairs) {
  const glm::vec3 sides = built_.bounds.hi - built_.bounds.lo;
  return encoder(id).collapse(pairs, built_.pairs, std::max({sides.x, sides.y, sides.z}));
}

PairTree DeviceBuild::download() {
  PairTree tree;
  tree.layout = NodeLayout::Interleaved;
  tree.root = built_.root;
  tree.depth = built_.depth;
  tree.bounds = built_.bounds;
  tree.origin = built_.origin;
  Buffer<glm::uvec4> pairs(gpu_, std::size_t(built_.pairs) * tree.pair_texels(), Access::Storage, "bvh nodes");
  Buffer<glm::uvec4> leaves(gpu_, built_.leaf_texels, Access::Storage, "bvh leaves");
  builder_.write(NodeLayout::Interleaved, Padding::Ray, pairs, leaves);
  tree.nodes.resize(pairs.size());
  tree.leaves.resize(leaves.size());
  pairs.download(tree.nodes);
  leaves.download(tree.leaves);
  return tree;
}

const Bvh& DeviceBuild::bvh() {
  if (bvh_) return *bvh_;
  Bvh bvh;
  if (built_.root != END_OF_TREE) bvh = ReadBack(download()).run();
  const BvhStats counted = bvh.stats;
  bvh.bounds = summary_.bounds;
  bvh.stats = summary_.stats;
  bvh.stats.leaves = counted.leaves;
  bvh.stats.depth = counted.depth;
  bvh.stats.largest_leaf = counted.largest_leaf;
  if (!bvh.nodes.empty()) bvh.stats.sah = sah_cost(bvh, settings_);
  return bvh_.emplace(std::move(bvh));
}

Bvh build_bvh_on_device(Context& gpu, std::span<const Triangle> triangles, const BuildSettings& settings) {
  return DeviceBuild(gpu, triangles, settings).bvh();
}

}  // namespace ballot
