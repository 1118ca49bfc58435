// DeviceScenes of scenes with instances: their trees, and how they follow an animation.

#include "engine/core/interruption.h"
#include "engine/core/parallel.h"
#include "engine/core/stopwatch.h"
#include "engine/model/instances.h"
#include "engine/scene/device_scene.h"
#include "engine/scene/scene_tree.h"
#include "engine/tree/device/device_build.h"
#include "engine/tree/host/refit.h"

namespace ballot {

namespace {

constexpr std::size_t kCachedTriangles = 1 << 12;  // smaller trees are built faster than files are read

/// Returns the trees of a scene whose triangles lie on the device, where they stay there too. The triangles of the
/// others are read back.
KnownTrees trees_there(Context& gpu, TrianglesThere& there, Scene& scene, const BuildSettings& settings) {
  const TreeLayout layout = tree_layout(scene);
  KnownTrees known(layout.first.size() - 1);
  for (std::size_t t = 0; t < known.size(); ++t) {
    const std::size_t first = layout.first[t], count = layout.first[t + 1] - first;
    const auto triangles = std::span(scene.triangles).subspan(first, count);
    if (count < kLeastThere) {
      if (count > 0 && !there.on_host) there.triangles.download(triangles, first);
      continue;
    }
    glm::vec3 most(0);
    for (std::size_t m = 0; m < layout.tree_of.size(); ++m)
      if (layout.tree_of[m] == t) most = glm::max(most, there.meshes[m].largest_triangle);
    known[t] = tree_there(triangles, build_there(gpu, there, first, count, settings), most);
  }
  return known;
}

/// Returns the meshes of a layout as they lie in the arrays of the scene.
std::vector<std::span<const Triangle>> meshes_of(const Scene& scene, const TreeLayout& layout) {
  std::vector<std::span<const Triangle>> meshes;
  for (std::size_t m = 0; m + 1 < layout.first.size(); ++m)
    meshes.push_back(std::span(scene.triangles).subspan(layout.first[m], layout.first[m + 1] - layout.first[m]));
  return meshes;
}

std::vector<Transform> transforms_of(const Scene& scene) {
  std::vector<Transform> transforms;
  for (const Placement& p : tree_layout(scene).placements) transforms.push_back(p.transform);
  return transforms;
}

}  // namespace

MeshTree tree_there(std::span<const Triangle> triangles, SceneTree built, const glm::vec3& largest_triangle) {
  MeshTree made{triangles, std::make_shared<Bvh>(std::move(built.bvh)), {}, std::move(built.there)};
  made.extents = {made.bvh->bounds, largest_triangle, made.bvh->is_empty()};
  return made;
}

MeshTree build_mesh(Context& gpu, std::span<const Triangle> triangles, const BuildSettings& settings, bool use_cache,
                    const Progress& progress, std::unique_ptr<DeviceBuild>& scratch) {
  if (builder_of(settings.builder).on_device && !settings.keeps_flat && triangles.size() < kLeastThere) {
    if (scratch)
      scratch->build(triangles);
    else
      scratch = std::make_unique<DeviceBuild>(gpu, triangles, settings);
    return make_mesh_tree(triangles, scratch->bvh());
  }
  const bool caches = use_cache && triangles.size() >= kCachedTriangles;
  SceneTree built = build_tree(gpu, triangles, settings, caches, progress);
  MeshTree made = make_mesh_tree(triangles, std::move(built.bvh));
  made.there = std::move(built.there);
  return made;
}

std::unique_ptr<Forest> build_forest(Context& gpu, const Scene& scene, const BuildSettings& settings, bool use_cache,
                                     const KnownTrees& known, const Progress& progress) {
  const TreeLayout layout = tree_layout(scene);
  std::vector<MeshTree> meshes;
  std::unique_ptr<DeviceBuild> scratch;
  BuildSettings whole =
      settings;  // leaves with a part of what stands in for a shape do not hold that part of the shape
  whole.split_budget = 0;
  std::size_t done = 0;
  for (const std::span<const Triangle> triangles : meshes_of(scene, layout)) {
    const std::size_t m = meshes.size();
    const ShapeKind kind = layout.kinds[m];
    const Progress part = [&](double share) {
      if (progress) progress((double(done) + share * double(triangles.size())) / double(scene.triangles.size()));
    };
    if (!known.empty() && known[m])
      meshes.push_back({triangles, known[m]->bvh, known[m]->extents, known[m]->there});
    else
      meshes.push_back(
          build_mesh(gpu, triangles, kind == ShapeKind::Triangles ? settings : whole, use_cache, part, scratch));
    if (kind != ShapeKind::Triangles)
      meshes[m].kind = kind, meshes[m].shapes = std::span(scene.shapes).subspan(layout.first[m], triangles.size());
    done += triangles.size();
  }
  std::vector<std::uint32_t> names;
  for (const std::uint32_t from : layout.from) names.push_back(scene.instances.placement_labels[from].number);
  return std::make_unique<Forest>(std::move(meshes), layout.placements,
                                  InstanceNumbers{layout.prims, std::move(names)});
}

/// Returns the trees of a forest whose meshes are those of a scene of the same layout.
KnownTrees trees_that_stay(const Forest& forest, const Scene& scene) {
  KnownTrees known;
  for (const std::span<const Triangle> triangles : meshes_of(scene, tree_layout(scene))) {
    const MeshTree& mesh = forest.meshes()[known.size()];
    known.push_back(std::ranges::equal(mesh.triangles, triangles) ? std::optional(mesh) : std::nullopt);
  }
  return known;
}

void DeviceScene::make_forest(bool use_cache, TrianglesThere* there, const Progress& progress) {
  const KnownTrees known = there ? trees_there(*gpu_, *there, scene_, build_) : KnownTrees();
  forest_ = build_forest(*gpu_, scene_, build_, use_cache, known, progress);
  bvh_ = forest_->summary();
  features_ = features_with(forest_->facts());
  tracer_ = std::make_unique<Tracer>(*gpu_, *forest_);
}

/// Moves the instances, and builds the trees of meshes whose triangles a pose has changed.
void DeviceScene::move_instances(Pose pose, double pose_s) {
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
    check_spreads(scene_);
    bounds = bounds_of_instances(scene_);
    gpu_->finish();
    if (pose.moves_triangles || turns)
      forest = build_forest(*gpu_, scene_, build_, false, trees_that_stay(*forest_, scene_), {});
    else if (!pose.moved.empty())
      tracer_->move_instances(transforms_of(scene_));
  } catch (...) {
    swap();
    throw;
  }
  if (forest) {
    drop_renderers();
    drop_queries();
    tracer_.reset();
    forest_ = std::move(forest);
    tracer_ = std::make_unique<Tracer>(*gpu_, *forest_);
  }
  walked_s_ = tracer_->walked_s();
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

/// Has the rest of the engine follow instances or meshes that have moved.
void DeviceScene::end_update(const Timer& timer) {
  if (forest_) bvh_ = forest_->summary(), features_.tree = forest_->facts();
  late_.is_elsewhere([this] {
    if (forest_) follow_transforms();
  });
  const double tree_s = timer.seconds();
  make_renderers();
  update_.seconds = timer.seconds();
  update_.ready_s = update_.seconds - tree_s;
}

/// Builds the trees of meshes anew that are overdue. If there is no room for one on the host, that at hand serves.
bool DeviceScene::rebuild_meshes() {
  bool built = false;
  for (std::size_t i = 0; i < policies_.size(); ++i) {
    if (!policies_[i].overdue()) continue;
    ask_interruption();
    try {
      rebuild(i);
      built = true;
    } catch (const Error&) {
      if (tracer_->tree().built(i)) throw;
    }
  }
  return built;
}

/// Brings the transforms of the instances to the scene.
void DeviceScene::bring_placements() {
  if (!forest_) return;
  const std::vector<std::uint32_t> from = tree_layout(scene_).from;
  SceneInstances& all = scene_.instances;
  for (std::size_t i = 0; i < from.size(); ++i) {
    Placement& p = all.placements[from[i]];
    p.transform = forest_->transforms()[i];
    if (!is_identity(p.transform)) all.mesh_labels[p.mesh].in_world = false;
  }
}

/// The same with the bounds that follow from them. The triangles are here.
void DeviceScene::follow_transforms() {
  bring_placements();
  scene_.bounds = bounds_of_instances(scene_);
}

const Scene& DeviceScene::placed_scene() {
  bring_placements();
  return scene_;
}

Triangle DeviceScene::triangle(std::uint32_t prim) const {
  if (!forest_) return scene().triangles[prim];
  const Forest::Place place = forest_->place_of(prim);
  late_.parts[forest_->mesh_of(place.instance)].bring();
  return forest_->triangle(place);
}

std::optional<glm::vec3> DeviceScene::shape_normal(const Hit& hit) const {
  if (!forest_ || !features_.tree.shapes) return {};
  return forest_->shape_normal(forest_->place_of(hit.prim), hit.u, hit.v);
}

std::uint64_t DeviceScene::triangle_count() const { return ballot::triangle_count(scene_); }

}  // namespace ballot
