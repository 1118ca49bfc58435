// Scenes that move: refits and builds of the tree of an Engine.
#include <algorithm>
#include <chrono>

#include "engine/built_tree.h"
#include "engine/bvh/refit.h"
#include "engine/tree/device_poser.h"

namespace ballot {

SceneTree build_tree(Context& gpu, std::span<const Triangle> triangles, const BuildSettings& settings, bool use_cache,
                     const Progress& progress) {
  if (builder_of(settings.builder).on_device) {
    auto there = std::make_shared<DeviceBuild>(gpu, triangles, settings);
    if (!there->has_box_origin()) return {there->bvh()};
    Bvh summary = there->summary();
    return {std::move(summary), std::move(there)};
  }
  if (!use_cache) return {build_bvh(triangles, settings, progress)};
  return {build_bvh_cached(triangles, settings, cache_folder() / "bvh", progress)};
}

std::vector<Triangle> Engine::move(std::vector<Triangle> triangles, UpdateMode mode) {
  refuse_instances("an update of vertices");
  const auto start = std::chrono::steady_clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); };
  const MovedTriangles moved = check_moved(scene_.triangles, bvh_.stats.degenerate, triangles, scene_.name);
  gpu_->finish();
  policy_.traced(tracer_->traced_s() - traced_s_);
  traced_s_ = tracer_->traced_s();
  const bool wanted = mode == UpdateMode::Refit || (mode == UpdateMode::Auto && !policy_.wants_build());
  topology_.reset();
  update_ = {};
  if (wanted && moved.same_area && refit(triangles, moved.bounds)) {
    update_.refitted = true;
    scene_.triangles.swap(triangles);
    features_.tree = facts_of(bvh_);
    tracer_->moved(bvh_, scene_.triangles, features_.tree);
    policy_.refitted(seconds(), bvh_.stats.sah);
    if (mode == UpdateMode::Auto && policy_.regrets_refit()) try_to_rebuild();
  } else {
    SceneTree built = build_tree(*gpu_, triangles, build_, false, {});
    gpu_->finish();
    scene_.triangles.swap(triangles);
    adopt(std::move(built));
    policy_.built(seconds(), bvh_.stats.sah);
  }
  scene_.bounds = moved.bounds;
  const double tree_s = seconds();
  make_renderers();
  update_.seconds = seconds();
  update_.ready_s = update_.seconds - tree_s;
  return triangles;
}

Pose Engine::pose(const AnimationClip& clip, double seconds) {
  const Animation& animation = *scene_.animation;
  if (animation.posed_vertices == 0) return pose_at(scene_, &clip, seconds);
  if (!poser_) poser_ = std::make_unique<DevicePoser>(*gpu_, animation);
  return pose_at(scene_, &clip, seconds,
                 [&](const PoseInput& input, std::span<PosedVertex> posed) { poser_->pose(input, posed); });
}

void Engine::set_time(std::size_t clip, double seconds, UpdateMode mode) {
  const auto start = std::chrono::steady_clock::now();
  const std::size_t clips = scene_.animation ? scene_.animation->clips.size() : 0;
  if (clip >= clips)
    fail(Failure::Arguments, "scene '{}' has {} animations; expected a number below that, found {}", scene_.name, clips,
         clip);
  Pose pose = this->pose(scene_.animation->clips[clip], seconds);
  const double pose_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (forest_) return move_instances(std::move(pose), pose_s);
  const auto swap = [&] {
    if (pose.moves_triangles) scene_.normals.swap(pose.normals);
    scene_.lights.swap(pose.lights);
  };
  swap();
  try {
    if (pose.moves_triangles) {
      move(std::move(pose.triangles), mode);
    } else {
      update_ = {};
      if (pose.moves_lights) gpu_->finish(), make_renderers();
    }
  } catch (...) {
    swap();
    throw;
  }
  std::ranges::copy(pose.views, scene_.views.begin());
  update_.pose_s = pose_s;
}

void Engine::adopt(SceneTree&& built) {
  bvh_ = std::move(built.bvh);
  features_.tree = facts_of(bvh_);
  tracer_->rebuilt(bvh_, scene_.triangles, features_.tree, std::move(built.there));
}

/// Builds the tree of the scene anew. If there is no room for it, the one at hand serves.
void Engine::try_to_rebuild() {
  try {
    const auto start = std::chrono::steady_clock::now();
    adopt(build_tree(*gpu_, scene_.triangles, build_, false, {}));
    policy_.built(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), bvh_.stats.sah);
    update_.refitted = false;
  } catch (const Error&) {
  }
}

/// Refits the tree, there or here. Returns false if the shape of the tree cannot stay; the tree is then as it was.
bool Engine::refit(std::span<const Triangle> triangles, const Bounds& bounds) {
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
