#include "engine/tree/device_tree.h"

#include <utility>

#include "engine/bvh/padding.h"
#include "engine/formats/encoded_cache.h"
#include "engine/tree/tree_arrays.h"

namespace ballot {

DeviceTree::DeviceTree(Context& gpu, const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts,
                       std::shared_ptr<DeviceBuild> built)
    : gpu_(gpu) {
  replace(bvh, triangles, facts, std::move(built));
}

void DeviceTree::replace(const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts,
                         std::shared_ptr<DeviceBuild> built) {
  gpu_.finish();
  coming_.clear();
  arrays_.clear();
  leaves_.clear();
  shapes_.clear();
  late_formats_.clear();
  spare_arrays_.clear();
  spare_leaves_.clear();
  spare_pairs_.clear();
  pairs_.clear();
  cache_.clear();
  built_ = std::move(built);
  has_moved_ = false;
  describe(bvh, triangles, facts);
}

bool DeviceTree::refit(std::span<const Triangle> triangles, const Bounds& bounds) {
  built_->upload(triangles);
  return refit(bounds);
}

bool DeviceTree::refit(const Bounds& bounds) {
  built_->begin_refit(bounds);
  for (auto& [key, array] : arrays_) {  // frontiers come behind the pairs that they are written from
    if (std::get<Source>(key) == Source::Host) continue;
    if (shapes_.contains(key))
      late_formats_.insert(key);  // is written anew when a kernel asks for it
    else if (std::get<TreeFormatId>(key) == TreeFormatId::Pair)
      built_->write(std::get<NodeLayout>(key), std::get<Padding>(key), array,
                    leaves_.at({LeafFormat::Vertices, std::get<Fetch>(key), Source::Device}));
    else
      write_frontier(key, array);
  }
  return built_->end_refit();
}

void DeviceTree::moved(const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts) {
  gpu_.finish();
  coming_.clear();
  const auto set_aside = [](auto& arrays, auto& spare) {
    spare.clear();
    for (auto at = arrays.begin(); at != arrays.end();)
      if (std::get<Source>(at->first) == Source::Host)
        spare.insert(arrays.extract(at++));
      else
        ++at;
  };
  set_aside(arrays_, spare_arrays_);
  set_aside(leaves_, spare_leaves_);
  spare_pairs_ = std::exchange(pairs_, {});
  cache_.clear();
  has_moved_ = true;
  describe(bvh, triangles, facts);
}

void DeviceTree::describe(const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts) {
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
  if (padding == Padding::Tree && padded_boxes_.empty()) padded_boxes_ = padded_boxes(whole_bvh(), triangles());
  const std::span<const Bounds> boxes = padding == Padding::Tree ? padded_boxes_ : std::span<const Bounds>();
  PairTree room;
  if (auto spare = spare_pairs_.extract(key)) room = std::move(spare.mapped());
  return pairs_.emplace(key, encode_pairs(whole_bvh(), triangles(), layout, boxes, std::move(room))).first->second;
}

const PairTree& DeviceTree::any_pairs() {
  return pairs_.empty() ? pairs(NodeLayout::Interleaved) : pairs_.begin()->second;
}

/// Returns about the bytes of the largest array of nodes or leaves.
std::uint64_t DeviceTree::largest_bytes() const {
  const BvhStats& s = bvh_->stats;
  const std::uint64_t leaves = s.leaves * LEAF_HEADER_TEXELS + s.references * TRIANGLE_TEXELS;
  return std::max<std::uint64_t>(leaves, (s.nodes / 2 + 1) * PAIR_TEXELS(LAYOUT_PAPER)) * sizeof(glm::uvec4);
}

Fetch DeviceTree::fitting_fetch(Fetch wanted) const {
  const DeviceInfo& device = gpu_.info();
  const std::uint64_t bytes = largest_bytes();
  const auto fits = [&](Fetch fetch) {
    if (fetch == Fetch::Reference) return device.buffer_address;
    return fetch == Fetch::Texel ? bytes / sizeof(glm::uvec4) <= device.max_texels : bytes <= device.max_storage_range;
  };
  for (const Fetch fetch : {wanted, Fetch::Reference, Fetch::Texel, Fetch::Storage})
    if (fits(fetch)) return fetch;
  return wanted;
}

std::uint32_t DeviceTree::root() {
  if (forest_) return forest_->top_facts().root;
  return built_ ? built_->built().root : any_pairs().root;
}

/// Returns an array on the device: a spare one of the same size, or a new one.
template <class Key>
DeviceTree::Texels DeviceTree::uploaded(std::map<Key, Texels>& spare, const Key& key,
                                        std::span<const glm::uvec4> texels, const char* name) {
  auto found = spare.extract(key);
  Texels array = found && found.mapped().size() == texels.size()
                     ? std::move(found.mapped())
                     : Texels(gpu_, texels.size(), access_for(std::get<Fetch>(key)), name);
  array.upload(texels);
  return array;
}

const DeviceTree::Texels& DeviceTree::upload(const FormatKey& key, std::span<const glm::uvec4> texels,
                                             const char* name) {
  return arrays_.emplace(key, uploaded(spare_arrays_, key, texels, name)).first->second;
}

/// Has the device write pairs. It writes the leaves again with them: the same texels.
const DeviceTree::Texels& DeviceTree::write_nodes(const FormatKey& key) {
  const auto layout = std::get<NodeLayout>(key);
  const Access access = access_for(std::get<Fetch>(key)) | Access::Storage;
  const BuiltTree& tree = built_->built();
  const LeavesKey leaves_key{LeafFormat::Vertices, std::get<Fetch>(key), Source::Device};
  auto leaves = leaves_.find(leaves_key);
  if (leaves == leaves_.end())
    leaves = leaves_.emplace(leaves_key, Texels(gpu_, tree.leaf_texels, access, "bvh leaves")).first;
  Texels pairs(gpu_, std::size_t(tree.pairs) * PAIR_TEXELS(std::uint32_t(layout)), access, "bvh nodes");
  built_->write(layout, std::get<Padding>(key), pairs, leaves->second);
  return arrays_.emplace(key, std::move(pairs)).first->second;
}

const DeviceTree::Texels& DeviceTree::nodes(const TreeAccess& a, Source source) {
  const FormatKey key{TreeFormatId::Pair, 0, a.layout, a.padding, a.fetch, source};
  if (const auto found = arrays_.find(key); found != arrays_.end()) return found->second;
  if (forest_) return forest_nodes(key);
  if (source == Source::Device) return write_nodes(key);
  return upload(key, pairs(a.layout, a.padding).nodes, "bvh nodes");
}

DeviceTree::FormatKey DeviceTree::format_key(TreeFormatId id, const TreeAccess& a, Source source) const {
  const TreeFormat& row = format_of(id);
  const std::uint32_t size = id == TreeFormatId::Frontier ? FRONTIER_NODES : 0;
  const NodeLayout layout = row.follows_pairs ? a.layout : NodeLayout::Interleaved;
  return {id, size, layout, row.padded ? a.padding : Padding::Ray, a.fetch, source};
}

/// Returns the pairs that the device has written, which it makes a format from.
const DeviceTree::Texels& DeviceTree::device_pairs(const FormatKey& key) const {
  return arrays_.at(
      {TreeFormatId::Pair, 0, std::get<NodeLayout>(key), std::get<Padding>(key), std::get<Fetch>(key), Source::Device});
}

void DeviceTree::write_frontier(const FormatKey& key, Texels& frontier) {
  built_->write_frontier(std::get<NodeLayout>(key), device_pairs(key), std::get<1>(key), frontier);
}

/// Has the device write a format from its pairs.
const DeviceTree::Texels& DeviceTree::write_format(const FormatKey& key, const TreeAccess& a) {
  const auto id = std::get<TreeFormatId>(key);
  const TreeFormat& row = format_of(id);
  const Access access = access_for(a.fetch) | Access::Storage;
  nodes({.layout = std::get<NodeLayout>(key), .padding = std::get<Padding>(key), .fetch = a.fetch}, Source::Device);
  if (!row.collapsed()) {
    Texels made(gpu_, std::size_t(FRONTIER_NODES) * 2 * FRONTIER_OCTANTS, access, row.name.data());
    write_frontier(key, made);
    return arrays_.emplace(key, std::move(made)).first->second;
  }
  const Texels& pairs = device_pairs(key);
  if (root() == END_OF_TREE) return arrays_.emplace(key, Texels(gpu_, 0, access, row.name.data())).first->second;
  WideShape shape = built_->collapse(id, pairs);
  Texels made(gpu_, built_->encoder(id).texels(shape), access, row.name.data());
  built_->encoder(id).write(shape, pairs, made);
  shapes_.emplace(key, std::move(shape));
  return arrays_.emplace(key, std::move(made)).first->second;
}

const DeviceTree::Texels& DeviceTree::format(TreeFormatId id, const TreeAccess& a, Source source) {
  const FormatKey key = format_key(id, a, source);
  if (const auto found = arrays_.find(key); found != arrays_.end()) {
    if (late_formats_.erase(key)) built_->encoder(id).write(shapes_.at(key), device_pairs(key), found->second);
    return found->second;
  }
  if (forest_) return forest_format(key);
  if (source == Source::Device) return write_format(key, a);
  const TreeFormat& row = format_of(id);
  if (auto coming = coming_.extract(key)) return upload(key, coming.mapped().get(), row.name.data());
  const PairTree& from = pairs(std::get<NodeLayout>(key), std::get<Padding>(key));
  return upload(key, encode_cached(row, from, std::get<1>(key), cache_), row.name.data());
}

void DeviceTree::prepare(TreeFormatId id, const TreeAccess& a, Source source) {
  const FormatKey key = format_key(id, a, source);
  const TreeFormat& row = format_of(id);
  if (forest_ || source == Source::Device || !row.collapsed() || arrays_.contains(key) || coming_.contains(key)) return;
  const PairTree& from = pairs(std::get<NodeLayout>(key), std::get<Padding>(key));
  coming_.emplace(key, std::async(std::launch::async, [&row, &from, size = std::get<1>(key), cache = cache_] {
                    return encode_cached(row, from, size, cache);
                  }));
}

const DeviceTree::Texels& DeviceTree::leaves(LeafFormat format, Fetch fetch, Source source) {
  const LeavesKey key{format, fetch, source};
  if (const auto found = leaves_.find(key); found != leaves_.end()) return found->second;
  if (forest_) return forest_leaves(key);
  if (source == Source::Device) {
    nodes({.fetch = fetch}, source);
    return leaves_.at(key);
  }
  const PairTree& tree = any_pairs();
  const std::vector<glm::uvec4> affine =
      format == LeafFormat::Affine ? make_affine_leaves(tree) : std::vector<glm::uvec4>();
  const std::vector<glm::uvec4>& texels = format == LeafFormat::Affine ? affine : tree.leaves;
  return leaves_.emplace(key, uploaded(spare_leaves_, key, texels, "bvh leaves")).first->second;
}

}  // namespace ballot
