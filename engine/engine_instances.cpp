// Engines of scenes with instances: their trees, and how they follow an animation.

#include "engine/ballot.h"
#include "engine/built_tree.h"
#include "engine/core/stopwatch.h"
#include "engine/scene/instances.h"
#include "engine/tree/build/device_build.h"

namespace ballot {

namespace {

constexpr std::size_t kCachedTriangles = 1 << 12;  // smaller trees are built faster than files are read

/// Returns the meshes of a scene as they lie in its arrays.
std::vector<std::vector<Triangle>> meshes_of(const Scene& scene) {
  const SceneInstances& all = scene.instances;
  std::vector<std::vector<Triangle>> meshes;
  for (std::size_t m = 0; m < all.meshes(); ++m)
    meshes.emplace_back(scene.triangles.begin() + std::ptrdiff_t(all.first[m]),
                        scene.triangles.begin() + std::ptrdiff_t(all.first[m + 1]));
  return meshes;
}

std::vector<Transform> transforms_of(const Scene& scene) {
  std::vector<Transform> transforms;
  for (const Placement& p : scene.instances.placements) transforms.push_back(p.transform);
  return transforms;
}

}  // namespace

std::unique_ptr<Forest> build_forest(Context& gpu, const Scene& scene, const BuildSettings& settings, bool use_cache,
                                     const Forest* before, const Progress& progress) {
  std::size_t mesh = 0, done = 0;
  const auto build = [&](std::span<const Triangle> triangles) -> Bvh {
    const Progress part = [&](double share) {
      if (progress) progress((double(done) + share * double(triangles.size())) / double(scene.triangles.size()));
    };
    const MeshTree* same = before ? &before->meshes()[mesh] : nullptr;
    ++mesh;
    Bvh made;
    if (same && std::ranges::equal(same->triangles, triangles))
      made = same->bvh;
    else if (builder_of(settings.builder).on_device)
      made = DeviceBuild(gpu, triangles, settings).bvh();
    else if (use_cache && triangles.size() >= kCachedTriangles)
      made = build_bvh_cached(triangles, settings, cache_folder() / "bvh", part);
    else
      made = build_bvh(triangles, settings, part);
    done += triangles.size();
    return made;
  };
  return std::make_unique<Forest>(meshes_of(scene), scene.instances.placements, build);
}

void Engine::make_forest(bool use_cache, const Progress& progress) {
  forest_ = build_forest(*gpu_, scene_, build_, use_cache, nullptr, progress);
  bvh_ = forest_->summary();
  features_ = features_with(forest_->facts());
  tracer_ = std::make_unique<Tracer>(*gpu_, *forest_);
}

/// Moves the instances, and builds the trees of meshes whose triangles a pose has changed.
void Engine::move_instances(Pose pose, double pose_s) {
  const Timer timer;
  std::vector<Placement> placements = scene_.instances.placements;
  bool turns = false;  // instances that are mirrored now, or no longer, are of another mesh
  for (const Pose::Moved& m : pose.moved) {
    turns |= placements[m.placement].mesh != m.to.mesh;
    placements[m.placement] = m.to;
  }
  const auto swap = [&] {
    scene_.instances.placements.swap(placements);
    if (!pose.moves_triangles) return;
    scene_.triangles.swap(pose.triangles);
    scene_.normals.swap(pose.normals);
    turn_corners(scene_, pose.turned);
  };
  swap();
  Bounds bounds;
  std::unique_ptr<Forest> forest;
  try {
    check_instances(scene_);
    bounds = bounds_of_instances(scene_);
    gpu_->finish();
    if (pose.moves_triangles || turns)
      forest = build_forest(*gpu_, scene_, build_, false, forest_.get(), {});
    else if (!pose.moved.empty())
      tracer_->move_instances(transforms_of(scene_));
  } catch (...) {
    swap();
    throw;
  }
  if (forest) {
    drop_renderers();
    rays_.reset();
    tracer_.reset();
    forest_ = std::move(forest);
    tracer_ = std::make_unique<Tracer>(*gpu_, *forest_);
  }
  scene_.bounds = bounds;
  scene_.lights = std::move(pose.lights);
  std::ranges::copy(pose.views, scene_.views.begin());
  bvh_ = forest_->summary();
  features_ = features_with(forest_->facts());
  const double tree_s = timer.seconds();
  make_renderers();
  update_ = {.seconds = timer.seconds(), .pose_s = pose_s};
  update_.ready_s = update_.seconds - tree_s;
}

Triangle Engine::triangle(std::uint32_t prim) const {
  return forest_ ? forest_->triangle(forest_->place_of(prim)) : scene().triangles[prim];
}

std::uint64_t Engine::triangle_count() const { return ballot::triangle_count(scene_); }

}  // namespace ballot
