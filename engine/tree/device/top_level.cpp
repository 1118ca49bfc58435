// The top-level tree of a forest on the device, and how it follows instances that move.
#include <bit>

#include "engine/core/error.h"
#include "engine/tree/device/device_tree.h"
#include "engine/tree/device/tree_arrays.h"

namespace ballot {

namespace {

// On a GPU the host is as quick for fewer instances, and its tree is traced a little faster. CPU devices are the host's
// own cores (tools/measured/instances.md).
constexpr std::size_t kLeastOnDevice = 1024;

/// Returns how kernels that do not ask for another way read trees.
Fetch usual_fetch(const DeviceInfo& device) {
  if (device.is_cpu()) return Fetch::Texel;
  return device.buffer_address ? Fetch::Reference : Fetch::Storage;
}

}  // namespace

bool DeviceTree::moves_on_device() const {
  if (!forest_ || forest_->has_groups() || !TopBuilder::runs_on(gpu_.info())) return false;
  const std::uint64_t bytes = std::uint64_t(forest_->size()) * (TOP_NODE_TEXELS + INSTANCE_TEXELS) * sizeof(glm::uvec4);
  if (forest_->size() > BUILD_INDEX_MASK || bytes > gpu_.info().max_storage_range) return false;
  return asked_on_device_.value_or(!gpu_.info().is_cpu() && forest_->size() >= kLeastOnDevice);
}

void DeviceTree::move_instances(const MovedTransforms& transforms) {
  gpu_.finish();
  if (moves_on_device())
    move_on_device(transforms);
  else
    move_on_host(transforms);
  take_facts();
  number_generation();
}

void DeviceTree::exchange(std::size_t mesh, MeshTree& with) {
  with = forest_->exchange(mesh, std::move(with));
  if (top_builder_) top_builder_->exchanged(mesh);
}

void DeviceTree::change_meshes(std::span<MeshChange> changes, const MovedTransforms& transforms) {
  gpu_.finish();
  for (MeshChange& c : changes) exchange(c.mesh, c.with);
  try {
    move_instances(transforms);
  } catch (...) {
    for (MeshChange& c : changes) exchange(c.mesh, c.with);
    move_instances({});
    throw;
  }
  for (const auto& [mesh, before, same_shape] : changes) {
    const MeshTree& now = forest_->meshes()[mesh];
    if (same_shape && now.there == built(mesh))
      meshes_[mesh].moved(*now.bvh, now.triangles);
    else
      meshes_[mesh].replace(*now.bvh, now.triangles, now.there);
    if (same_shape)
      set_refitted(mesh);
    else
      refitted_.erase(mesh);
  }
  padded_reach_ = least_reach();
}

void DeviceTree::take(Forest& forest, std::span<const std::optional<std::uint32_t>> from) {
  gpu_.finish();
  std::vector<MeshArrays> meshes;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const MeshTree& mesh = forest.meshes()[i];
    meshes.push_back(from[i] ? std::move(meshes_[*from[i]]) : MeshArrays());
    if (from[i])
      meshes.back().refer(*mesh.bvh, mesh.triangles);
    else
      meshes.back().replace(*mesh.bvh, mesh.triangles, mesh.there);
  }
  refitted_.clear();
  meshes_ = std::move(meshes);
  for (auto& [key, array] : arrays_) array.renumber(from);
  for (auto& [key, array] : leaves_) array.renumber(from);
  tables_.clear();
  tops_.clear();
  top_builder_.reset();
  forest_ = &forest;
  padded_reach_ = least_reach();
  take_facts();
  begin_generation();
}

void DeviceTree::move_on_host(const MovedTransforms& transforms) {
  if (transforms.there)
    forest_->move(read_transforms(*transforms.there, forest_->size()));
  else
    forest_->move(transforms.stay() ? std::span(forest_->transforms()) : transforms.here);
  top_builder_.reset();
  const TopTree& top = forest_->top();
  for (auto& [fetch, texels] : tops_) {
    if (texels.size() < top.texels.size()) texels = Texels(gpu_, top.texels.size(), access_for(fetch), "bvh top level");
    texels.record_upload(top.texels);
  }
}

void DeviceTree::move_on_device(const MovedTransforms& transforms) {
  if (!transforms.stay() && !transforms.there) forest_->check_count(transforms.here);
  std::unique_ptr<TopBuilder> fresh;
  std::map<Fetch, Texels> made;  // until the move has succeeded, the tree of the host stays
  if (!top_builder_) {
    fresh = std::make_unique<TopBuilder>(gpu_, *forest_);
    for (const auto& [fetch, texels] : tops_) made.emplace(fetch, room_for_top(fetch, fresh->texels()));
    const Fetch usual = usual_fetch(gpu_.info());  // of the first trace, unless it asks for another
    if (made.empty()) made.emplace(usual, room_for_top(usual, fresh->texels()));
  }
  std::vector<Texels*> tops;
  for (auto& [fetch, texels] : fresh ? made : tops_) tops.push_back(&texels);
  const bool first = transforms.stay() && fresh;
  const MovedTransforms moved = first ? MovedTransforms(forest_->transforms()) : transforms;
  const TopFacts facts = (fresh ? fresh : top_builder_)->move(moved, tops);
  if (fresh) {
    top_builder_ = std::move(fresh);
    tops_ = std::move(made);
  }
  if (!moved.there) return forest_->moved_elsewhere(first ? std::span<const Transform>() : moved.here, facts);
  forest_->moved_elsewhere([builder = top_builder_.get()](std::span<Transform> to) { builder->read(to); }, facts);
}

/// Returns a buffer that the device writes a top-level tree into.
DeviceTree::Texels DeviceTree::room_for_top(Fetch fetch, std::size_t texels) {
  return {gpu_, texels, access_for(fetch) | Access::Storage, "bvh top level"};
}

const DeviceTree::Texels& DeviceTree::top(Fetch fetch) {
  if (const auto found = tops_.find(fetch); found != tops_.end()) return found->second;
  if (top_builder_) {
    Texels made = room_for_top(fetch, top_builder_->texels());
    top_builder_->write(made);
    return tops_.emplace(fetch, std::move(made)).first->second;
  }
  const TopTree& top = forest_->top();
  Texels made(gpu_, top.texels.size(), access_for(fetch), "bvh top level");
  made.record_upload(top.texels);
  return tops_.emplace(fetch, std::move(made)).first->second;
}

const Buffer<glm::vec4>& DeviceTree::shapes() {
  if (shapes_ && shapes_of_ == forest_->exchanges()) return *shapes_;
  const std::vector<MeshTree>& meshes = forest_->meshes();
  const auto word = [](std::size_t x) { return std::bit_cast<float>(std::uint32_t(x)); };
  std::vector<glm::vec4> texels(meshes.size());
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const std::size_t size = meshes[m].kind == ShapeKind::Spheres ? 1 : 2;
    texels[m] = {word(std::size_t(meshes[m].kind)), word(texels.size()), word(size), 0};
    for (const Shape& s : meshes[m].shapes) {
      texels.push_back(s.a);
      if (size > 1) texels.push_back(s.b);
    }
  }
  gpu_.finish();
  shapes_.emplace(gpu_, texels.size(), Access::Storage, "shapes");
  shapes_->upload(texels);
  shapes_of_ = forest_->exchanges();
  return *shapes_;
}

TopTree DeviceTree::top_tree() {
  if (!top_builder_) return forest_->top();
  TopTree tree;
  static_cast<TopFacts&>(tree) = forest_->top_facts();
  tree.texels.resize(top_builder_->texels());
  tops_.begin()->second.download(tree.texels);
  return tree;
}

}  // namespace ballot
