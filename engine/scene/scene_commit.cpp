// Edits of a scene that are made true at once: a DeviceScene with other meshes, other placements, or both moved.
#include <algorithm>

#include "engine/core/stopwatch.h"
#include "engine/model/instances.h"
#include "engine/scene/scene_tree.h"

namespace ballot {
namespace {

using From = std::vector<std::optional<std::uint32_t>>;

/// Returns for each tree of a layout which tree of another one is the same: it holds the same meshes.
From trees_from(const TreeLayout& before, const TreeLayout& now, const From& same_mesh) {
  From from(now.first.size() - 1);
  std::vector<std::size_t> held(before.first.size() - 1), holds(from.size()), same(from.size());
  for (const std::uint32_t tree : before.tree_of) ++held[tree];
  for (std::size_t m = 0; m < now.tree_of.size(); ++m) {
    const std::uint32_t tree = now.tree_of[m];
    if (holds[tree]++ == 0 && same_mesh[m]) from[tree] = before.tree_of[*same_mesh[m]];
    // Meshes keep their order, so those of one tree that are there still follow one another there.
    same[tree] += same_mesh[m] && from[tree] == before.tree_of[*same_mesh[m]];
  }
  for (std::size_t t = 0; t < from.size(); ++t)
    if (from[t] && (same[t] != holds[t] || held[*from[t]] != holds[t])) from[t].reset();
  return from;
}

/// Throws Error(Arguments) if the device cannot read vertices that are to lie there.
void check_there(const MovedVertices& mesh, const Context& gpu) {
  if (!mesh.there) return;
  const std::string where = fmt::format("mesh {}", mesh.number);
  check_there(*mesh.there, gpu, where);
  if (!mesh.indexed() && mesh.there->count < 3 * mesh.triangles)
    fail(Failure::Arguments, "{}: {} vertices, but its {} triangles have three each", where, mesh.there->count,
         mesh.triangles);
}

}  // namespace

bool DeviceScene::reads_transforms_there() const {
  if (!forest_ || !tracer_->tree().moves_on_device()) return false;
  const SceneInstances& all = scene_.instances;  // those of one tree stand for one instance of it
  return forest_->size() == all.placements.size() && std::ranges::none_of(all.mesh_labels, &MeshLabel::in_world);
}

void DeviceScene::commit(SceneChange& change, UpdateMode mode) {
  const Timer timer;
  for (const MovedVertices& mesh : change.vertices) check_there(mesh, *gpu_);
  if (change.structure)
    restructure(*change.structure);
  else if (change.vertices.empty() && change.transforms.stay())
    update_ = {};
  else if (forest_ || (takes_vertices(0) && !change.vertices.empty()))
    move_all(change, mode);
  else if (!change.vertices.empty())
    move_flat(change.vertices, mode);
  for (std::size_t i = 0; i < change.masks.size(); ++i) scene_.instances.placements[i].mask = change.masks[i];
  update_.seconds = timer.seconds();
}

/// Gives the scene other meshes and placements. Trees of meshes that it has already stay.
void DeviceScene::restructure(SceneStructure& structure) {
  late_.bring();
  begin_update();
  const TreeLayout before = tree_layout(scene_);
  structure.exchange(scene_);
  try {
    complete_instances(scene_);
    const From from = trees_from(before, tree_layout(scene_), structure.same_as);
    if (scene_.instanced())
      replant(from);
    else if (forest_ || from.size() != 1 || !from[0])
      plant_flat();
  } catch (...) {
    structure.exchange(scene_);
    throw;
  }
  if (forest_)
    late_.is_elsewhere([this] { bring_transforms(); });
  else
    scene_.bounds = bounds_of_vertices(scene_.triangles, scene_.name);
  walked_s_ = tracer_->walked_s();
  scene_.animation.reset();  // nothing moves by it: such scenes are not edited
  posed_.reset();
  poser_.reset();
  indexed_.clear();
  mesh_extents_.clear();
  watch_lateness();
  make_renderers();
}

/// Returns the tree of a flat scene as that of a mesh with the same triangles.
MeshTree DeviceScene::whole_tree(std::span<const Triangle> triangles) {
  const std::shared_ptr<DeviceBuild>& there = tracer_->tree().built();
  MeshTree made = make_mesh_tree(triangles, there ? there->summary() : bvh_);
  made.there = there;
  return made;
}

/// Has a forest of the scene take the place of the trees of before.
void DeviceScene::replant(const From& from) {
  KnownTrees known(from.size());
  const TreeLayout layout = tree_layout(scene_);
  for (std::size_t t = 0; t < from.size(); ++t) {
    if (!from[t]) continue;
    const auto triangles = std::span(scene_.triangles).subspan(layout.first[t], layout.first[t + 1] - layout.first[t]);
    known[t] = forest_ ? forest_->meshes()[*from[t]] : whole_tree(triangles);
  }
  const Timer timer;
  std::unique_ptr<Forest> forest = build_forest(*gpu_, scene_, build_, false, known, {});
  std::vector<RefitPolicy> policies(from.size());
  for (std::size_t t = 0; t < from.size(); ++t)
    if (from[t])
      policies[t] = policies_[*from[t]];
    else
      policies[t].built(timer.seconds(), forest->meshes()[t].bvh->stats.sah);
  drop_renderers();
  if (forest_) {
    tracer_->take(*forest, from);
  } else {
    drop_queries();
    tracer_ = std::make_unique<Tracer>(*gpu_, *forest);
  }
  forest_ = std::move(forest);
  policies_ = std::move(policies);
  bvh_ = forest_->summary();
  features_ = features_with(forest_->facts());
}

/// Has one tree over the scene take the place of the trees of before.
void DeviceScene::plant_flat() {
  const Timer timer;
  SceneTree built = build_tree(*gpu_, scene_.triangles, build_, false, {});
  gpu_->finish();
  drop_renderers();
  if (forest_) {
    drop_queries();
    tracer_.reset();
    forest_.reset();
    bvh_ = std::move(built.bvh);
    features_ = features_with(facts_of(bvh_));
    tracer_ = std::make_unique<Tracer>(*gpu_, bvh_, scene_.triangles, features_.tree, std::move(built.there));
  } else {
    adopt(std::move(built));
    features_ = features_with(facts_of(bvh_));
  }
  policies_.assign(1, {});
  policies_[0].built(timer.seconds(), bvh_.stats.sah);
}

void DeviceScene::drop_queries() {
  points_.reset();
  rays_.reset();
  kernels_.clear();
}

}  // namespace ballot
