#include "engine/tree/device_tree.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "engine/bvh/padding.h"
#include "engine/tree/tree_arrays.h"

namespace ballot {

namespace {

Access access_of(Fetch fetch, Source source) {
  return source == Source::Device ? access_for(fetch) | Access::Storage : access_for(fetch);
}

/// Returns the key of a format's array for a kernel that reads trees in this way.
NodesKey nodes_key(TreeFormatId id, const TreeAccess& a, Source source) {
  const TreeFormat& row = format_of(id);
  const bool as_read = id == TreeFormatId::Pair || row.follows_pairs;
  return {id, as_read ? a.layout : NodeLayout::Interleaved, row.padded ? a.padding : Padding::Ray, a.fetch, source};
}

glm::uvec4 texel(const glm::vec3& v, float w) {
  const auto bits = [](float x) { return std::bit_cast<std::uint32_t>(x); };
  return {bits(v.x), bits(v.y), bits(v.z), bits(w)};
}

}  // namespace

DeviceTree::DeviceTree(Context& gpu, const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts,
                       std::shared_ptr<DeviceBuild> built)
    : gpu_(gpu) {
  meshes_.emplace_back(gpu);
  replace(bvh, triangles, facts, std::move(built));
}

DeviceTree::DeviceTree(Context& gpu, Forest& forest) : gpu_(gpu), forest_(&forest) {
  for (const MeshTree& mesh : forest.meshes()) meshes_.emplace_back(gpu).replace(*mesh.bvh, mesh.triangles, {});
  padded_reach_ = least_reach();
  facts_ = forest.facts();
  generation_ = next_revision();
}

/// Returns the smallest reach of the meshes that can be hit.
float DeviceTree::least_reach() const {
  float reach = INFINITY;
  for (const MeshTree& mesh : forest_->meshes())
    if (!mesh.extents.empty) reach = std::min(reach, ballot::padded_reach(mesh.bvh->bounds));
  return reach;
}

/// Frees the arrays that nobody has asked for since the trees changed last.
void DeviceTree::begin_generation() {
  std::erase_if(arrays_, [](const auto& item) { return !item.second.used; });
  for (auto& [key, array] : arrays_) array.used = false;
  generation_ = next_revision();
}

void DeviceTree::replace(const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts,
                         std::shared_ptr<DeviceBuild> built) {
  gpu_.finish();
  meshes_[0].replace(bvh, triangles, std::move(built));
  refitted_.clear();
  describe(facts);
}

bool DeviceTree::refit(std::span<const Triangle> triangles, const Bounds& bounds) {
  built()->upload(triangles);
  return refit(bounds);
}

bool DeviceTree::refit(const Bounds& bounds) {
  MeshArrays& mesh = meshes_[0];
  built()->begin_refit(bounds);
  refitted_.clear();
  for (auto& [key, array] : arrays_) {  // frontiers come behind the pairs that they are written from
    if (key.source == Source::Host || !array.is_current(0, mesh.revision())) continue;
    if (format_of(key.id).collapsed()) continue;  // is written anew when a kernel asks for it
    JoinedArray& leaves = leaves_of({LeafFormat::Vertices, key.fetch, Source::Device});
    if (key.id == TreeFormatId::Pair)
      mesh.write(key, array.part(0), leaves.part(0));
    else
      mesh.write_format(key, array_of({TreeFormatId::Pair, key.layout, key.padding, key.fetch, key.source}).part(0),
                        array.part(0));
    refitted_.push_back(&array);
    refitted_.push_back(&leaves);
  }
  return built()->end_refit();
}

void DeviceTree::moved(const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts) {
  gpu_.finish();
  meshes_[0].moved(bvh, triangles);
  for (JoinedArray* array : refitted_) array->set_revision(0, meshes_[0].revision());
  refitted_.clear();
  describe(facts);
}

void DeviceTree::describe(const TreeFacts& facts) {
  const Bounds& bounds = bvh().bounds;
  box_origin_ = ballot::box_origin(bounds);
  padded_reach_ = ballot::padded_reach(bounds);
  shear_ = shear_scale(bounds);
  facts_ = facts;
  facts_.far |= box_origin_ != glm::vec3(0);
  begin_generation();
}

/// Returns about the bytes of the largest array of nodes or leaves.
std::uint64_t DeviceTree::largest_bytes() const {
  const BvhStats& s = bvh().stats;
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

std::uint32_t DeviceTree::root() { return forest_ ? forest_->top_facts().root : meshes_[0].root(); }

JoinedArray& DeviceTree::array_of(const NodesKey& key) {
  const char* name = key.id == TreeFormatId::Pair ? "bvh nodes" : format_of(key.id).name.data();
  JoinedArray& array = arrays_.try_emplace(key, gpu_, access_of(key.fetch, key.source), name).first->second;
  array.used = true;
  return array;
}

JoinedArray& DeviceTree::leaves_of(const LeavesKey& key) {
  return leaves_.try_emplace(key, gpu_, access_of(key.fetch, key.source), "bvh leaves").first->second;
}

/// Returns the meshes whose content there is of an earlier revision.
std::vector<std::size_t> DeviceTree::stale_in(const JoinedArray& array) const {
  std::vector<std::size_t> stale;
  for (std::size_t i = 0; i < meshes_.size(); ++i)
    if (!array.is_current(i, meshes_[i].revision())) stale.push_back(i);
  return stale;
}

/// Encodes and uploads what has changed.
template <class Key>
void DeviceTree::follow_host(JoinedArray& array, const Key& key) {
  const std::vector<std::size_t> stale = stale_in(array);
  if (stale.empty() && !meshes_.empty()) return;
  std::vector<Encoded> encoded;
  std::vector<JoinedArray::Wanted> wanted;
  for (const std::size_t i : stale) wanted.push_back({i, encoded.emplace_back(meshes_[i].encode(key)).texels.size()});
  array.make_room(meshes_.size(), wanted);
  for (std::size_t k = 0; k < stale.size(); ++k) {
    array.upload(stale[k], encoded[k].texels);
    array.set_revision(stale[k], meshes_[stale[k]].revision());
  }
}

/// Has the device write pairs that have changed, and their leaves with them: the same texels for all pairs.
void DeviceTree::follow_pairs(JoinedArray& array, const NodesKey& key) {
  JoinedArray& leaves = leaves_of({LeafFormat::Vertices, key.fetch, key.source});
  const std::vector<std::size_t> stale = stale_in(array), old_leaves = stale_in(leaves);
  std::vector<JoinedArray::Wanted> pairs, blocks;
  for (const std::size_t i : stale) pairs.push_back({i, meshes_[i].pair_texels(key.layout)});
  for (const std::size_t i : old_leaves) blocks.push_back({i, meshes_[i].leaf_texels()});
  if (!pairs.empty()) array.make_room(meshes_.size(), pairs);
  if (!blocks.empty()) leaves.make_room(meshes_.size(), blocks);
  for (const std::size_t i : stale) {
    meshes_[i].write(key, array.part(i), leaves.part(i));
    array.set_revision(i, meshes_[i].revision());
    leaves.set_revision(i, meshes_[i].revision());
  }
}

/// Has the device write a format from its pairs, which have been written.
void DeviceTree::follow_format(JoinedArray& array, const NodesKey& key) {
  const JoinedArray& pairs = array_of({TreeFormatId::Pair, key.layout, key.padding, key.fetch, key.source});
  const std::vector<std::size_t> stale = stale_in(array);
  std::vector<JoinedArray::Wanted> wanted;
  for (const std::size_t i : stale) wanted.push_back({i, meshes_[i].texels(key, pairs.part(i))});
  if (!wanted.empty()) array.make_room(meshes_.size(), wanted);
  for (const std::size_t i : stale) {
    meshes_[i].write_format(key, pairs.part(i), array.part(i));
    array.set_revision(i, meshes_[i].revision());
  }
}

const DeviceTree::Texels& DeviceTree::nodes(const TreeAccess& a, Source source) {
  return format(TreeFormatId::Pair, a, source);
}

const DeviceTree::Texels& DeviceTree::format(TreeFormatId id, const TreeAccess& a, Source source) {
  const NodesKey key = nodes_key(id, a, source);
  JoinedArray& array = array_of(key);
  if (source == Source::Host) {
    follow_host(array, key);
  } else if (id == TreeFormatId::Pair) {
    follow_pairs(array, key);
  } else {
    nodes({.layout = key.layout, .padding = key.padding, .fetch = key.fetch}, source);
    follow_format(array, key);
  }
  return array.texels();
}

void DeviceTree::prepare(TreeFormatId id, const TreeAccess& a, Source source) {
  const NodesKey key = nodes_key(id, a, source);
  if (forest_ || source == Source::Device) return;
  const auto found = arrays_.find(key);
  if (found == arrays_.end() || !found->second.is_current(0, meshes_[0].revision())) meshes_[0].prepare(key);
}

const DeviceTree::Texels& DeviceTree::leaves(LeafFormat format, Fetch fetch, Source source) {
  const LeavesKey key{format, fetch, source};
  JoinedArray& array = leaves_of(key);
  if (source == Source::Host)
    follow_host(array, key);
  else if (!array.is_current(0, meshes_[0].revision()))
    nodes({.fetch = fetch}, source);
  return array.texels();
}

std::vector<glm::uvec4> DeviceTree::table_texels(TreeFormatId id, const TreeAccess& a, LeafFormat leaf_format) {
  // Of arrays that the kernel reads. There are none of the others.
  const auto nodes = arrays_.find(nodes_key(TreeFormatId::Pair, a, Source::Host));
  const auto format = arrays_.find(nodes_key(id, a, Source::Host));
  const auto leaves = leaves_.find({leaf_format, a.fetch, Source::Host});
  const auto first = [](const auto& found, const auto& all, std::size_t i, std::uint64_t revision) {
    return found != all.end() && found->second.is_current(i, revision) ? found->second.first(i) : 0u;
  };
  std::vector<glm::uvec4> texels;
  for (std::size_t i = 0; i < meshes_.size(); ++i) {
    const Bounds& b = meshes_[i].bvh().bounds;
    const ShearScale shear = shear_scale(b);
    const std::uint64_t now = meshes_[i].revision();
    texels.push_back(texel(b.lo, ballot::padded_reach(b)));
    texels.push_back(texel(b.hi, shear.scale));
    texels.push_back(texel(ballot::box_origin(b), shear.near));
    texels.push_back({meshes_[i].root(), first(nodes, arrays_, i, now), first(leaves, leaves_, i, now),
                      first(format, arrays_, i, now)});
  }
  return texels;
}

const DeviceTree::Texels& DeviceTree::mesh_table(TreeFormatId id, const TreeAccess& a, LeafFormat leaf_format) {
  const TableKey key{id, a, leaf_format};
  auto table = tables_.find(key);
  if (table != tables_.end() && table->second.generation == generation_) return table->second.texels;
  const std::vector<glm::uvec4> texels = table_texels(id, a, leaf_format);
  if (table == tables_.end() || table->second.texels.size() != texels.size())
    table = tables_.insert_or_assign(key, Table{Texels(gpu_, texels.size(), access_for(a.fetch), "table of meshes"), 0})
                .first;
  table->second.texels.upload(texels);
  table->second.generation = generation_;
  return table->second.texels;
}

}  // namespace ballot
