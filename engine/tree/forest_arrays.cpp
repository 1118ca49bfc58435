// The arrays of a forest on the device: those of all meshes one behind the other, the table that says where each mesh
// begins, and the top-level tree.
#include <bit>
#include <cmath>

#include "engine/bvh/padding.h"
#include "engine/core/error.h"
#include "engine/formats/encoded_cache.h"
#include "engine/tree/device_tree.h"
#include "engine/tree/tree_arrays.h"

namespace ballot {

namespace {

constexpr std::uint64_t kMostTexels = 1ull << 31;  // a texel's index keeps the top bit clear

glm::uvec4 texel(const glm::vec3& v, float w) {
  const auto bits = [](float x) { return std::bit_cast<std::uint32_t>(x); };
  return {bits(v.x), bits(v.y), bits(v.z), bits(w)};
}

}  // namespace

DeviceTree::DeviceTree(Context& gpu, Forest& forest) : gpu_(gpu), bvh_(&forest.summary()), forest_(&forest) {
  padded_reach_ = INFINITY;  // of the meshes that can be hit, the smallest
  for (const MeshTree& mesh : forest.meshes())
    if (!mesh.extents.empty) padded_reach_ = std::min(padded_reach_, ballot::padded_reach(mesh.bvh.bounds));
  facts_ = forest.facts();
  generation_ = next_generation();
}

const std::vector<PairTree>& DeviceTree::mesh_pairs(NodeLayout layout, Padding padding) {
  const auto key = std::pair(layout, padding);
  if (const auto found = mesh_pairs_.find(key); found != mesh_pairs_.end()) return found->second;
  std::vector<PairTree> trees;
  for (const MeshTree& mesh : forest_->meshes()) {
    const std::vector<Bounds> boxes =
        padding == Padding::Tree ? padded_boxes(mesh.bvh, mesh.triangles) : std::vector<Bounds>();
    trees.push_back(encode_pairs(mesh.bvh, mesh.triangles, layout, boxes));
  }
  return mesh_pairs_.emplace(key, std::move(trees)).first->second;
}

const std::vector<PairTree>& DeviceTree::any_mesh_pairs() {
  return mesh_pairs_.empty() ? mesh_pairs(NodeLayout::Interleaved, Padding::Ray) : mesh_pairs_.begin()->second;
}

DeviceTree::Joined DeviceTree::joined(const char* name,
                                      const std::function<std::vector<glm::uvec4>(std::size_t)>& part) const {
  Joined all;
  for (std::size_t i = 0; i < forest_->meshes().size(); ++i) {
    all.firsts.push_back(std::uint32_t(all.texels.size()));
    const std::vector<glm::uvec4> texels = part(i);
    all.texels.insert(all.texels.end(), texels.begin(), texels.end());
    if (all.texels.size() > kMostTexels)
      fail(Failure::Work, "{} of meshes 0 to {}: {} bytes; at most {} can be addressed; use fewer or smaller meshes",
           name, i, all.texels.size() * sizeof(glm::uvec4), kMostTexels * sizeof(glm::uvec4));
  }
  return all;
}

const DeviceTree::Texels& DeviceTree::forest_nodes(const FormatKey& key) {
  const std::vector<PairTree>& trees = mesh_pairs(std::get<NodeLayout>(key), std::get<Padding>(key));
  Joined all = joined("bvh nodes", [&](std::size_t i) { return trees[i].nodes; });
  firsts_[key] = std::move(all.firsts);
  return upload(key, all.texels, "bvh nodes");
}

const DeviceTree::Texels& DeviceTree::forest_format(const FormatKey& key) {
  const TreeFormat& row = format_of(std::get<TreeFormatId>(key));
  const std::vector<PairTree>& trees = mesh_pairs(std::get<NodeLayout>(key), std::get<Padding>(key));
  Joined all =
      joined(row.name.data(), [&](std::size_t i) { return encode_cached(row, trees[i], std::get<1>(key), cache_); });
  firsts_[key] = std::move(all.firsts);
  return upload(key, all.texels, row.name.data());
}

const DeviceTree::Texels& DeviceTree::forest_leaves(const LeavesKey& key) {
  const std::vector<PairTree>& trees = any_mesh_pairs();
  const bool affine = std::get<LeafFormat>(key) == LeafFormat::Affine;
  Joined all =
      joined("bvh leaves", [&](std::size_t i) { return affine ? make_affine_leaves(trees[i]) : trees[i].leaves; });
  leaf_firsts_[key] = std::move(all.firsts);
  Texels made(gpu_, all.texels.size(), access_for(std::get<Fetch>(key)), "bvh leaves");
  made.upload(all.texels);
  return leaves_.emplace(key, std::move(made)).first->second;
}

const DeviceTree::Texels& DeviceTree::mesh_table(TreeFormatId id, const TreeAccess& a, LeafFormat leaf_format) {
  const TableKey key{id, FRONTIER_NODES, a.layout, a.padding, a.fetch, leaf_format};
  if (const auto found = tables_.find(key); found != tables_.end()) return found->second;
  const auto firsts_of = [&](const auto& all, const auto& wanted) {
    const auto found = all.find(wanted);  // none if the kernel reads no such array
    return found != all.end() ? found->second : Firsts(forest_->meshes().size(), 0);
  };
  const Firsts nodes = firsts_of(firsts_, FormatKey{TreeFormatId::Pair, 0, a.layout, a.padding, a.fetch, Source::Host});
  const Firsts format = firsts_of(firsts_, format_key(id, a, Source::Host));
  const Firsts leaves = firsts_of(leaf_firsts_, LeavesKey{leaf_format, a.fetch, Source::Host});
  std::vector<glm::uvec4> texels;
  for (std::size_t i = 0; i < forest_->meshes().size(); ++i) {
    const Bounds& b = forest_->meshes()[i].bvh.bounds;
    const ShearScale shear = shear_scale(b);
    texels.push_back(texel(b.lo, ballot::padded_reach(b)));
    texels.push_back(texel(b.hi, shear.scale));
    texels.push_back(texel(ballot::box_origin(b), shear.near));
    texels.push_back({any_mesh_pairs()[i].root, nodes[i], leaves[i], format[i]});
  }
  Texels made(gpu_, texels.size(), access_for(a.fetch), "table of meshes");
  made.upload(texels);
  return tables_.emplace(key, std::move(made)).first->second;
}

}  // namespace ballot
