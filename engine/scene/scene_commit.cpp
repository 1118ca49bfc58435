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

std::vector<bool> DeviceScene::meshes_there() {
  const TreeLayout layout = tree_layout(scene_);
  std::vector<bool> there;
  for (const std::uint32_t tree : layout.tree_of) {
    const HostCopy& triangles = late_.parts[tree];
    if (triangles.is_late() && !tracer_->tree().built(tree)) triangles.bring();
    there.push_back(triangles.is_late());
  }
  return there;
}

bool DeviceScene::reads_transforms_there() const {
  if (!forest_ || !tracer_->tree().moves_on_device()) return false;
  const SceneInstances& all = scene_.instances;  // those of one tree stand for one instance of it
  return forest_->size() == all.placements.size() && std::ranges::none_of(all.mesh_labels, &MeshLabel::in_world);
}

void DeviceScene::commit(SceneChange& change, UpdateMode mode) {
  const Timer timer;
  for (const MovedVertices& mesh : change.vertices) check_there(mesh, *gpu_);
  if (change.structure)
    restructure(change);
  else if (change.vertices.empty() && change.transforms.stay())
    update_ = {};
  else if (forest_ || (takes_vertices(0) && !change.vertices.empty()))
    move_all(change, mode);
  else if (!change.vertices.empty())
    move_flat(change.vertices, mode);
  for (std::size_t i = 0; i < change.masks.size(); ++i) scene_.instances.placements[i].mask = change.masks[i];
  update_.seconds = timer.seconds();
}

/// Returns true if the device builds the tree of a new mesh of the scene, which lies there.
bool DeviceScene::builds_there(const TreeLayout& layout, std::size_t mesh) const {
  const bool is_large = !scene_.instanced() || scene_.instances.triangles_of(mesh) >= kLeastThere;
  return is_large && !layout.shares(mesh) && gpu_->info().float64 && builder_of(build_.builder).on_device;
}

/// Has the host have the triangles of those meshes of a structure that lie on the device and do not stay there: they
/// are in trees with others that differ, or are small. Drops these from the change. Returns for each tree whether its
/// triangles stay.
std::vector<bool> DeviceScene::bring_apart(SceneChange& change, const TreeLayout& before, const From& from) {
  const SceneStructure& to = *change.structure;
  const SceneInstances& all = scene_.instances;
  const TreeLayout now = tree_layout(scene_);
  std::vector<bool> stay(from.size());
  for (std::size_t m = 0; m < all.meshes(); ++m) {
    const std::uint32_t tree = now.tree_of[m], number = all.mesh_labels[m].number;
    if (!to.elsewhere[m] || all.triangles_of(m) == 0) continue;
    const auto room = std::span(scene_.triangles).subspan(all.first[m], all.triangles_of(m));
    if (to.same_as[m]) {
      stay[tree] = from[tree].has_value();
      if (stay[tree]) continue;
      const std::uint32_t old = before.tree_of[*to.same_as[m]];
      tracer_->tree().built(old)->triangles().download(room, to.instances.first[*to.same_as[m]] - before.first[old]);
      continue;
    }
    stay[tree] = builds_there(now, m);
    if (stay[tree]) continue;
    change.there.at(number)->triangles.download(room);
    change.there.erase(number);
  }
  return stay;
}

/// Gives the scene other meshes and placements. Trees of meshes that it has already stay, and their triangles where
/// they are.
void DeviceScene::restructure(SceneChange& change) {
  SceneStructure& structure = *change.structure;
  begin_update();
  const TreeLayout before = tree_layout(scene_);
  const Bounds bounds = scene_.bounds;
  std::vector<bool> stay;
  structure.exchange(scene_);
  try {
    complete_instances(scene_);
    const From from = trees_from(before, tree_layout(scene_), structure.same_as);
    stay = bring_apart(change, before, from);
    if (!change.there.empty())
      scene_.bounds = change.there.begin()->second->meshes[0].bounds;
    else if (std::ranges::none_of(stay, std::identity()))
      scene_.bounds = scene_.instanced() ? bounds : bounds_of_vertices(scene_.triangles, scene_.name);
    if (scene_.instanced())
      replant(from, change.there);
    else if (forest_ || from.size() != 1 || !from[0])
      plant_flat(change.there);
  } catch (...) {
    structure.exchange(scene_);
    scene_.bounds = bounds;
    throw;
  }
  late_.is_elsewhere(forest_ ? std::function<void()>([this] { follow_transforms(); }) : nullptr);
  walked_s_ = tracer_->walked_s();
  scene_.animation.reset();  // nothing moves by it: such scenes are not edited
  posed_.reset();
  poser_.reset();
  indexed_.clear();
  mesh_extents_.clear();
  watch_lateness();
  for (std::size_t tree = 0; tree < stay.size(); ++tree)
    if (stay[tree]) triangles_are_there(tree);
  make_renderers();
}

/// Returns the extent of the largest triangle of a flat scene, which lies on the device, along each axis.
glm::vec3 DeviceScene::largest_there() const {
  const std::shared_ptr<DeviceBuild> built = tracer_->tree().built();
  MovedVertices all;
  all.triangles = built->triangles().size();
  all.there = DeviceVertices{.buffer = {built, &built->triangles()}, .count = 3 * all.triangles};
  IndexedTriangles scratch(*gpu_, all.triangles);
  scratch.record(std::span(&all, 1), built->triangles());
  return scratch.found()[0].extents.largest_triangle;
}

/// Returns the tree of a flat scene as that of a mesh with the same triangles.
MeshTree DeviceScene::whole_tree(std::span<const Triangle> triangles) {
  const std::shared_ptr<DeviceBuild>& there = tracer_->tree().built();
  if (late_.parts[0].is_late()) return tree_there(triangles, {there->summary(), there}, largest_there());
  MeshTree made = make_mesh_tree(triangles, there ? there->summary() : bvh_);
  made.there = there;
  return made;
}

/// Has a forest of the scene take the place of the trees of before.
void DeviceScene::replant(const From& from, const TrianglesOfMeshes& there) {
  KnownTrees known(from.size());
  const TreeLayout layout = tree_layout(scene_);
  for (std::size_t t = 0; t < from.size(); ++t) {
    if (!from[t]) continue;
    const auto triangles = std::span(scene_.triangles).subspan(layout.first[t], layout.first[t + 1] - layout.first[t]);
    known[t] = forest_ ? forest_->meshes()[*from[t]] : whole_tree(triangles);
  }
  const Timer timer;
  for (std::size_t m = 0; m < layout.tree_of.size(); ++m) {
    const auto mesh = there.find(scene_.instances.mesh_labels[m].number);
    if (mesh == there.end()) continue;
    const std::uint32_t t = layout.tree_of[m];
    const std::size_t count = scene_.instances.triangles_of(m);
    known[t] =
        tree_there(std::span(scene_.triangles).subspan(layout.first[t], count),
                   build_there(*gpu_, *mesh->second, 0, count, build_), mesh->second->meshes[0].largest_triangle);
  }
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
void DeviceScene::plant_flat(const TrianglesOfMeshes& there) {
  const Timer timer;
  SceneTree built = there.empty() ? build_tree(*gpu_, scene_.triangles, build_, false, {})
                                  : build_there(*gpu_, *there.begin()->second, 0, scene_.triangles.size(), build_);
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
