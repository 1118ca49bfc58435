// Scenes that move: refits and builds of the tree of a DeviceScene.
#include <algorithm>
#include <utility>

#include "engine/core/interruption.h"
#include "engine/core/stopwatch.h"
#include "engine/scene/scene_tree.h"
#include "engine/tree/host/refit.h"

namespace ballot {

SceneTree build_tree(Context& gpu, std::span<const Triangle> triangles, const BuildSettings& settings, bool use_cache,
                     const Progress& progress) {
  if (settings.keeps_flat && builder_of(settings.builder).on_device) {
    BuildSettings here = settings;
    here.builder = BuilderId::Balanced;
    return build_tree(gpu, triangles, here, false, progress);
  }
  if (builder_of(settings.builder).on_device) {
    auto there = std::make_shared<DeviceBuild>(gpu, triangles, settings);
    if (!there->has_box_origin()) return {there->bvh()};
    Bvh summary = there->summary();
    return {std::move(summary), std::move(there)};
  }
  if (!use_cache || settings.keeps_flat) return {build_bvh(triangles, settings, progress)};
  return {build_bvh_cached(triangles, settings, cache_folder() / "bvh", progress)};
}

SceneTree build_there(Context& gpu, TrianglesThere& there, std::size_t first, std::size_t count,
                      const BuildSettings& settings) {
  std::optional<Buffer<Triangle>> part;
  if (count < there.triangles.size()) {
    part.emplace(gpu, count, Access::Storage, "triangles of the tree build");
    part->copy_from(there.triangles, first, 0, count);
  }
  auto built = std::make_shared<DeviceBuild>(gpu, std::move(part ? *part : there.triangles), settings);
  Bvh summary = built->summary();
  return {std::move(summary), std::move(built)};
}

/// Tells the policies how long queries have walked the trees since they were last told. A mesh has taken the share that
/// it has in what random rays are expected to take. Of instances none is told as long as no mesh was refitted.
void DeviceScene::count_walks() {
  const double walked_s = tracer_->walked_s(), spent = walked_s - std::exchange(walked_s_, walked_s);
  if (!forest_) return policies_[0].traced(spent);
  if (std::ranges::none_of(policies_, [](const RefitPolicy& p) { return p.refit_s() > 0; })) return;
  const std::vector<double> shares = forest_->walk_shares();
  for (std::size_t i = 0; i < policies_.size(); ++i) policies_[i].traced(spent * shares[i]);
}

bool DeviceScene::rebuild_if_overdue() {
  count_walks();
  if (forest_) return rebuild_meshes();
  if (!policies_[0].overdue()) return false;
  ask_interruption();
  gpu_->finish();
  if (!tracer_->tree().built()) late_.bring();
  try_to_rebuild();
  make_renderers();
  return policies_[0].decay() == 1;
}

void DeviceScene::begin_update() {
  gpu_->finish();
  count_walks();
  forget_shape();
}

void DeviceScene::forget_shape() {
  topology_.reset();
  if (near_zero_) live_.reset(), near_zero_.reset();
  update_ = {};
}

UnsetVector<Triangle> DeviceScene::move(UnsetVector<Triangle> triangles, UpdateMode mode) {
  refuse_instances("an update of vertices");
  const Timer timer;
  late_.bring();
  const MovedTriangles moved = check_moved(scene_.triangles, bvh_.stats.degenerate, triangles, scene_.name);
  begin_update();
  posed_.reset();
  mesh_extents_.clear();
  if (policies_[0].wants_refit(mode) && moved.same_area && refit(triangles, moved.bounds)) {
    update_.refitted = true;
    scene_.triangles.swap(triangles);
    features_.tree = facts_of(bvh_);
    tracer_->moved(bvh_, scene_.triangles, features_.tree);
    policies_[0].refitted(timer.seconds(), bvh_.stats.sah);
    if (mode == UpdateMode::Auto && policies_[0].regrets_refit()) try_to_rebuild();
  } else {
    SceneTree built = build_tree(*gpu_, triangles, build_, false, {});
    gpu_->finish();
    scene_.triangles.swap(triangles);
    adopt(std::move(built));
    policies_[0].built(timer.seconds(), bvh_.stats.sah);
  }
  scene_.bounds = moved.bounds;
  const double tree_s = timer.seconds();
  make_renderers();
  update_.seconds = timer.seconds();
  update_.ready_s = update_.seconds - tree_s;
  return triangles;
}

void DeviceScene::adopt(SceneTree&& built) {
  bvh_ = std::move(built.bvh);
  features_.tree = facts_of(bvh_);
  tracer_->rebuilt(bvh_, scene_.triangles, features_.tree, std::move(built.there));
}

/// Builds the tree of the scene anew, of the triangles that the device has if it made the tree. If there is no room for
/// it, the one at hand serves.
void DeviceScene::try_to_rebuild() {
  try {
    const Timer timer;
    if (const std::shared_ptr<DeviceBuild> built = tracer_->tree().built())
      built->rebuild(), adopt({built->summary(), built});
    else
      adopt(build_tree(*gpu_, scene_.triangles, build_, false, {}));
    policies_[0].built(timer.seconds(), bvh_.stats.sah);
    update_.refitted = false;
  } catch (const Error&) {
  }
}

/// Refits the tree, there or here. Returns false if the shape of the tree cannot stay; the tree is then as it was.
bool DeviceScene::refit(std::span<const Triangle> triangles, const Bounds& bounds) {
  DeviceTree& tree = tracer_->tree();
  if (!tree.built()) {
    refit_bvh(bvh_, triangles, build_);
    return true;
  }
  if (!tree.refit(triangles, bounds)) {
    tree.refit(scene_.triangles, scene_.bounds);
    return false;
  }
  bvh_ = tree.built()->summary();
  return true;
}

}  // namespace ballot
