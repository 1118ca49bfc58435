#include "engine/tree/device/device_tree.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "engine/tree/device/tree_arrays.h"
#include "engine/tree/host/padding.h"

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
  meshes_.emplace_back();
  replace(bvh, triangles, facts, std::move(built));
}

DeviceTree::DeviceTree(Context& gpu, Forest& forest) : gpu_(gpu), forest_(&forest) {
  for (const MeshTree& mesh : forest.meshes()) meshes_.emplace_back().replace(*mesh.bvh, mesh.triangles, mesh.there);
  padded_reach_ = least_reach();
  take_facts();
  number_generation();
}

/// Returns the smallest reach of the meshes that can be hit.
float DeviceTree::least_reach() const {
  float reach = INFINITY;
  for (const MeshTree& mesh : forest_->meshes())
    if (!mesh.extents.empty) reach = std::min(reach, ballot::padded_reach(mesh.extents.bounds));
  return reach;
}

/// Frees the arrays that nobody has asked for since the trees changed last.
void DeviceTree::begin_generation() {
  std::erase_if(arrays_, [](const auto& item) { return !item.second.used; });
  for (auto& [key, array] : arrays_) array.used = false;
  number_generation();
}

void DeviceTree::set_doubles(std::shared_ptr<DoubleCorners> doubles) {
  if (doubles == doubles_) return;
  gpu_.finish();
  doubles_ = std::move(doubles);
  number_generation();
}

float DeviceTree::doubles_room() const {
  const BvhStats& s = bvh().stats;
  return doubles_ && s.references + s.degenerate != s.triangles ? doubles_->room() : 0;
}

void DeviceTree::number_generation() {
  facts_.doubles = doubles_ != nullptr;
  generation_ = next_revision();
  oracle_scene_.reset();
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

bool DeviceTree::refit(const Bounds& bounds, std::size_t number) {
  MeshArrays& mesh = meshes_[number];
  mesh.built()->begin_refit(bounds);
  std::vector<JoinedArray*>& refitted = refitted_[number];
  refitted.clear();
  for (auto& [key, array] : arrays_) {  // frontiers come behind the pairs that they are written from
    if (key.source == Source::Host || !array.is_current(number, mesh.revision())) continue;
    if (format_of(key.id).collapsed()) continue;  // is written anew when a kernel asks for it
    JoinedArray& leaves = leaves_of({LeafFormat::Vertices, key.fetch, Source::Device});
    if (key.id == TreeFormatId::Pair)
      mesh.write(key, array.part(number), leaves.part(number));
    else
      mesh.write_format(key,
                        array_of({TreeFormatId::Pair, key.layout, key.padding, key.fetch, key.source}).part(number),
                        array.part(number));
    refitted.push_back(&array);
    refitted.push_back(&leaves);
  }
  return mesh.built()->end_refit();
}

/// Tells that what the last refit() has written is that of the mesh as it is now.
void DeviceTree::set_refitted(std::size_t mesh) {
  const auto refitted = refitted_.extract(mesh);
  if (!refitted) return;
  for (JoinedArray* array : refitted.mapped()) array->set_revision(mesh, meshes_[mesh].revision());
}

void DeviceTree::moved(const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts) {
  gpu_.finish();
  meshes_[0].moved(bvh, triangles);
  set_refitted(0);
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

/// Takes the facts of the forest. Arrays grow by up to a quarter as meshes change.
void DeviceTree::take_facts() {
  facts_ = forest_->facts();
  facts_.large = largest_bytes() > (3ull << 30);
  facts_.doubles = doubles_ != nullptr;
}

/// Returns about the bytes of the largest array of nodes or leaves.
std::uint64_t DeviceTree::largest_bytes() const {
  const BvhStats& s = bvh().stats;
  const std::uint64_t leaves =
      std::uint64_t(s.leaves) * LEAF_HEADER_TEXELS + std::uint64_t(s.references) * TRIANGLE_TEXELS;
  return std::max(leaves, (std::uint64_t(s.nodes) / 2 + 1) * PAIR_TEXELS(LAYOUT_PAPER)) * sizeof(glm::uvec4);
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

const OracleScene& DeviceTree::oracle_scene() {
  bring_triangles();
  if (oracle_scene_) return *oracle_scene_;
  std::vector<const PairTree*> pairs;
  for (MeshArrays& mesh : meshes_) pairs.push_back(&mesh.any_pairs());
  return forest_ ? oracle_scene_.emplace(*forest_, std::move(pairs)) : oracle_scene_.emplace(*pairs[0], triangles());
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

Source DeviceTree::source_of(TreeFormatId id, LeafFormat leaves) const {
  if (!format_of(id).on_device || leaves != LeafFormat::Vertices) return Source::Host;
  return std::ranges::any_of(meshes_, [](const MeshArrays& mesh) { return bool(mesh.built()); }) ? Source::Device
                                                                                                 : Source::Host;
}

bool DeviceTree::is_stale(const JoinedArray& array) const {
  for (std::size_t i = 0; i < meshes_.size(); ++i)
    if (!array.is_current(i, meshes_[i].revision())) return true;
  return false;
}

/// Makes room for what has changed in an array, and encodes what the host makes of it. texels_there(mesh) returns the
/// size of what the device will write.
template <class Key, class Size>
std::vector<DeviceTree::Stale> DeviceTree::make_room(JoinedArray& array, const Key& key, const Size& texels_there) {
  std::vector<Stale> stale;
  std::vector<JoinedArray::Wanted> wanted;
  for (std::size_t i = 0; i < meshes_.size(); ++i) {
    if (array.is_current(i, meshes_[i].revision())) continue;
    Stale& s = stale.emplace_back(Stale{i, {}});
    const bool there = meshes_[i].writes_there(key.source);
    wanted.push_back({i, there ? texels_there(i) : s.encoded.emplace(meshes_[i].encode(key)).texels.size()});
  }
  if (!stale.empty() || meshes_.empty()) array.make_room(meshes_.size(), wanted);
  return stale;
}

/// Uploads what has changed and is encoded, and has write_there(mesh) write the rest.
template <class Write>
void DeviceTree::follow(JoinedArray& array, const std::vector<Stale>& stale, const Write& write_there) {
  for (const Stale& s : stale) {
    if (s.encoded)
      array.upload(s.mesh, s.encoded->texels);
    else
      write_there(s.mesh);
    array.set_revision(s.mesh, meshes_[s.mesh].revision());
  }
}

/// The device writes the leaves with the pairs: the same texels for all pairs.
void DeviceTree::follow_pairs(JoinedArray& array, const NodesKey& key) {
  const LeavesKey leaves_key{LeafFormat::Vertices, key.fetch, key.source};
  JoinedArray& leaves = leaves_of(leaves_key);
  const auto leaf_texels = [&](std::size_t i) { return meshes_[i].leaf_texels(); };
  const std::vector<Stale> blocks = make_room(leaves, leaves_key, leaf_texels);
  const std::vector<Stale> pairs =
      make_room(array, key, [&](std::size_t i) { return meshes_[i].pair_texels(key.layout); });
  const auto write = [&](std::size_t i) { meshes_[i].write(key, array.part(i), leaves.part(i)); };
  follow(array, pairs, write);
  follow(leaves, blocks, [&](std::size_t i) {
    if (!std::ranges::binary_search(pairs, i, {}, &Stale::mesh)) write(i);
  });
}

/// The device writes a format from its pairs.
void DeviceTree::follow_format(JoinedArray& array, const NodesKey& key) {
  const NodesKey pairs_key{TreeFormatId::Pair, key.layout, key.padding, key.fetch, key.source};
  JoinedArray& pairs = array_of(pairs_key);
  follow_pairs(pairs, pairs_key);
  const std::vector<Stale> stale =
      make_room(array, key, [&](std::size_t i) { return meshes_[i].texels(key, pairs.part(i)); });
  follow(array, stale, [&](std::size_t i) { meshes_[i].write_format(key, pairs.part(i), array.part(i)); });
}

const DeviceTree::Texels& DeviceTree::nodes(const TreeAccess& a, Source source) {
  return format(TreeFormatId::Pair, a, source);
}

const DeviceTree::Texels& DeviceTree::format(TreeFormatId id, const TreeAccess& a, Source source) {
  const NodesKey key = nodes_key(id, a, source);
  JoinedArray& array = array_of(key);
  if (source == Source::Host)
    follow(array, make_room(array, key, [](std::size_t) { return 0; }), [](std::size_t) {});
  else if (id == TreeFormatId::Pair)
    follow_pairs(array, key);
  else
    follow_format(array, key);
  return array.texels();
}

bool DeviceTree::has_pairs(const TreeAccess& a, Source source) const {
  const auto pairs = arrays_.find(nodes_key(TreeFormatId::Pair, a, source));
  const auto leaves = leaves_.find({LeafFormat::Vertices, a.fetch, source});
  return pairs != arrays_.end() && leaves != leaves_.end() && !is_stale(pairs->second) && !is_stale(leaves->second);
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
    follow(array, make_room(array, key, [](std::size_t) { return 0; }), [](std::size_t) {});
  else if (is_stale(array))
    nodes({.fetch = fetch}, source);
  return array.texels();
}

/// Returns the array that has the leaf blocks of a mesh as the host made them; null if there is none.
const JoinedArray* DeviceTree::leaves_there(std::size_t mesh) const {
  for (const auto& [key, array] : leaves_)
    if (key.format == LeafFormat::Vertices && key.source == Source::Host &&
        array.is_current(mesh, meshes_[mesh].revision()))
      return &array;
  return nullptr;
}

void DeviceTree::let_go() {
  for (std::size_t i = 0; i < meshes_.size(); ++i) {
    MeshArrays& mesh = meshes_[i];
    mesh.let_go();
    if (mesh.may_go() && (mesh.built() || leaves_there(i)))
      mesh.let_host_go([this, i] { return leaves_there(i)->download(i); });
  }
}

/// Writes the table of meshes anew where they have changed, or lie elsewhere.
void DeviceTree::write_table(const TableKey& key, Table& table) {
  const auto& [id, a, leaf_format, source] = key;
  // Of arrays that the kernel reads. There are none of the others.
  const auto nodes = arrays_.find(nodes_key(TreeFormatId::Pair, a, source));
  const auto format = arrays_.find(nodes_key(id, a, source));
  const auto leaves = leaves_.find({leaf_format, a.fetch, source});
  const auto first = [](const auto& found, const auto& all, std::size_t i, std::uint64_t revision) {
    return found != all.end() && found->second.is_current(i, revision) ? found->second.first(i) : 0u;
  };
  table.revisions.resize(meshes_.size());
  table.rows.resize(meshes_.size());
  for (std::size_t i = 0; i < meshes_.size(); ++i) {
    const std::uint64_t now = meshes_[i].revision();
    MeshRow& row = table.rows[i];
    if (std::exchange(table.revisions[i], now) != now) {
      const Bounds& b = meshes_[i].bvh().bounds;
      const ShearScale shear = shear_scale(b);
      row = {texel(b.lo, ballot::padded_reach(b)),
             texel(b.hi, shear.scale),
             texel(ballot::box_origin(b), shear.near),
             {meshes_[i].root(), 0, 0, 0}};
    }
    row[3] = {row[3].x, first(nodes, arrays_, i, now), first(leaves, leaves_, i, now), first(format, arrays_, i, now)};
  }
}

const DeviceTree::Texels& DeviceTree::mesh_table(TreeFormatId id, const TreeAccess& a, LeafFormat leaf_format,
                                                 Source source) {
  const TableKey key{id, a, leaf_format, source};
  auto found = tables_.find(key);
  if (found == tables_.end()) {
    Texels texels(gpu_, meshes_.size() * MESH_TEXELS, access_for(a.fetch), "table of meshes");
    found = tables_.emplace(key, Table{std::move(texels), 0, {}, {}}).first;
  }
  Table& table = found->second;
  if (table.generation == generation_) return table.texels;
  write_table(key, table);
  if (!table.rows.empty()) table.texels.record_upload(std::span(table.rows.front().data(), table.texels.size()));
  table.generation = generation_;
  return table.texels;
}

}  // namespace ballot
