#include "engine/tree/device_tree.h"

#include <atomic>

#include "engine/bvh/padding.h"

namespace ballot {

namespace {

Access access_for(Fetch fetch) {
  switch (fetch) {
    case Fetch::Texel:
      return Access::Texel;
    case Fetch::Reference:
      return Access::Address;
    case Fetch::Storage:
      break;
  }
  return Access::Storage;
}

std::uint64_t next_generation() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

}  // namespace

DeviceTree::DeviceTree(Context& gpu, const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts)
    : gpu_(gpu) {
  replace(bvh, triangles, facts);
}

void DeviceTree::replace(const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts) {
  gpu_.finish();
  arrays_.clear();
  leaves_.clear();
  pairs_.clear();
  padded_boxes_.clear();
  bvh_ = &bvh;
  triangles_ = triangles;
  box_origin_ = ballot::box_origin(bvh.bounds);
  padded_reach_ = ballot::padded_reach(bvh.bounds);
  shear_ = shear_scale(bvh.bounds);
  facts_ = facts;
  facts_.far |= box_origin_ != glm::vec3(0);
  generation_ = next_generation();
}

const PairTree& DeviceTree::pairs(NodeLayout layout, Padding padding) {
  const auto key = std::pair(layout, padding);
  if (const auto found = pairs_.find(key); found != pairs_.end()) return found->second;
  if (padding == Padding::Tree && padded_boxes_.empty()) padded_boxes_ = padded_boxes(*bvh_, triangles_);
  const std::span<const Bounds> boxes = padding == Padding::Tree ? padded_boxes_ : std::span<const Bounds>();
  return pairs_.emplace(key, encode_pairs(*bvh_, triangles_, layout, boxes)).first->second;
}

const PairTree& DeviceTree::any_pairs() {
  return pairs_.empty() ? pairs(NodeLayout::Interleaved) : pairs_.begin()->second;
}

std::uint32_t DeviceTree::root() { return any_pairs().root; }

const DeviceTree::Texels& DeviceTree::upload(const FormatKey& key, std::span<const glm::uvec4> texels,
                                             const char* name) {
  Texels made(gpu_, texels.size(), access_for(std::get<Fetch>(key)), name);
  made.upload(texels);
  return arrays_.emplace(key, std::move(made)).first->second;
}

const DeviceTree::Texels& DeviceTree::nodes(const TreeAccess& a) {
  const FormatKey key{TreeFormatId::Pair, 0, a.layout, a.padding, a.fetch};
  if (const auto found = arrays_.find(key); found != arrays_.end()) return found->second;
  return upload(key, pairs(a.layout, a.padding).nodes, "bvh nodes");
}

const DeviceTree::Texels& DeviceTree::format(TreeFormatId id, const TreeAccess& a) {
  const TreeFormat& row = format_of(id);
  const std::uint32_t size = id == TreeFormatId::Frontier ? a.frontier : 0;
  const NodeLayout layout = row.follows_pairs ? a.layout : NodeLayout::Interleaved;
  const Padding padding = row.follows_pairs ? a.padding : Padding::Ray;
  const FormatKey key{id, size, layout, padding, a.fetch};
  if (const auto found = arrays_.find(key); found != arrays_.end()) return found->second;
  return upload(key, row.encode(pairs(layout, padding), size), row.name.data());
}

const DeviceTree::Texels& DeviceTree::leaves(LeafFormat format, Fetch fetch) {
  const auto key = std::pair(format, fetch);
  if (const auto found = leaves_.find(key); found != leaves_.end()) return found->second;
  const PairTree& tree = any_pairs();
  const std::vector<glm::uvec4> affine =
      format == LeafFormat::Affine ? make_affine_leaves(tree) : std::vector<glm::uvec4>();
  const std::vector<glm::uvec4>& texels = format == LeafFormat::Affine ? affine : tree.leaves;
  Texels made(gpu_, texels.size(), access_for(fetch), "bvh leaves");
  made.upload(texels);
  return leaves_.emplace(key, std::move(made)).first->second;
}

}  // namespace ballot
