// Engines of scenes with instances: their trees, and how they follow an animation.

#include "engine/ballot.h"
#include "engine/built_tree.h"
#include "engine/bvh/refit.h"
#include "engine/core/parallel.h"
#include "engine/core/stopwatch.h"
#include "engine/scene/instances.h"
#include "engine/tree/build/device_build.h"

namespace ballot {

namespace {

constexpr std::size_t kCachedTriangles = 1 << 12;  // smaller trees are built faster than files are read
// Smaller trees are read back: each that stays on the device takes a dozen buffers and kernels of its own.
constexpr std::size_t kLeastThere = 1 << 16;

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

/// Returns of the transforms of all placements those that the trees of a scene have. Those of meshes that lie in one
/// tree with others must be the identity.
std::vector<Transform> transforms_of_trees(const Scene& scene, std::span<const Transform> all) {
  const TreeLayout layout = tree_layout(scene);
  const std::vector<Placement>& placements = scene.instances.placements;
  if (all.size() != placements.size())
    fail(Failure::Arguments, "{} transforms, but the scene has {} instances; expected one for each", all.size(),
         placements.size());
  for (std::size_t i = 0; i < all.size(); ++i)
    if (layout.shares(placements[i].mesh) && !is_identity(all[i]))
      fail(Failure::Arguments,
           "instance {}: its mesh {} ('{}') lies in one tree with others, which stays where it is; give it the "
           "identity, or load the file with instances 'copy' and move the mesh's vertices",
           i, placements[i].mesh, scene.instances.mesh_name(placements[i].mesh));
  std::vector<Transform> of_trees;
  for (const std::uint32_t from : layout.from) of_trees.push_back(all[from]);
  return of_trees;
}

}  // namespace

MeshTree build_mesh(Context& gpu, std::span<const Triangle> triangles, const BuildSettings& settings, bool use_cache,
                    const Progress& progress) {
  const bool caches = use_cache && triangles.size() >= kCachedTriangles;
  SceneTree built = build_tree(gpu, triangles, settings, caches, progress);
  if (built.there && triangles.size() < kLeastThere) built = {built.there->bvh()};
  MeshTree made = make_mesh_tree(triangles, std::move(built.bvh));
  made.there = std::move(built.there);
  return made;
}

std::unique_ptr<Forest> build_forest(Context& gpu, const Scene& scene, const BuildSettings& settings, bool use_cache,
                                     const KnownTrees& known, const Progress& progress) {
  const TreeLayout layout = tree_layout(scene);
  std::vector<MeshTree> meshes;
  std::size_t done = 0;
  for (const std::span<const Triangle> triangles : meshes_of(scene, layout)) {
    const Progress part = [&](double share) {
      if (progress) progress((double(done) + share * double(triangles.size())) / double(scene.triangles.size()));
    };
    if (const std::size_t m = meshes.size(); !known.empty() && known[m])
      meshes.push_back({triangles, known[m]->bvh, known[m]->extents, known[m]->there});
    else
      meshes.push_back(build_mesh(gpu, triangles, settings, use_cache, part));
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

void Engine::make_forest(bool use_cache, const Progress& progress) {
  forest_ = build_forest(*gpu_, scene_, build_, use_cache, {}, progress);
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
    rays_.reset();
    points_.reset();
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

/// Returns the tree of a mesh of a forest for triangles that have moved, and tells the mesh's policy. It is refitted on
/// the host.
MeshTree Engine::follow_mesh(std::size_t mesh, std::span<const Triangle> triangles, UpdateMode mode, bool same_area) {
  const Timer timer;
  RefitPolicy& policy = policies_[mesh];
  if (same_area && policy.wants_refit(mode)) {
    Bvh tree = *forest_->meshes()[mesh].bvh;
    refit_bvh(tree, triangles, build_);
    policy.refitted(timer.seconds(), tree.stats.sah);
    update_.refitted = mode != UpdateMode::Auto || !policy.regrets_refit();
    if (update_.refitted) return make_mesh_tree(triangles, std::move(tree));
  }
  MeshTree tree = build_mesh(*gpu_, triangles, build_, false, {});
  policy.built(timer.seconds(), tree.bvh->stats.sah);
  return tree;
}

void Engine::move_mesh(std::size_t mesh, std::vector<Triangle> triangles, UpdateMode mode) {
  const std::size_t count = scene_.instances.triangles_of(mesh);
  if (count == 0) return;
  const std::size_t tree = tree_with(scene_.instances.first[mesh]);
  if (forest_->meshes()[tree].triangles.size() != count)
    fail(Failure::Arguments,
         "mesh {} ('{}') lies in one tree with others; load the file with instances 'copy' to move its vertices", mesh,
         scene_.instances.mesh_name(mesh));
  move_tree(tree, std::move(triangles), mode);
}

/// Moves the triangles of a mesh of the forest.
void Engine::move_tree(std::size_t mesh, std::vector<Triangle> triangles, UpdateMode mode) {
  const Timer timer;
  late_trees_[mesh].bring();
  const MeshTree& old = forest_->meshes()[mesh];
  const std::size_t first = first_of(mesh);
  const MovedTriangles moved = check_moved(old.triangles, old.bvh->stats.degenerate, triangles, scene_.name);
  begin_update();
  const RefitPolicy before = policies_[mesh];
  try {
    if (old.there) {
      Buffer<Triangle> there = DeviceBuilder::upload(*gpu_, triangles);
      follow_there(mesh, there, {moved.bounds, extents_of({}, triangles).largest_triangle, false}, mode);
    } else {
      MeshTree made = follow_mesh(mesh, triangles, mode, moved.same_area);
      made.triangles = old.triangles;
      tracer_->tree().change_mesh(mesh, std::move(made), update_.refitted);
    }
  } catch (...) {
    policies_[mesh] = before;
    throw;
  }
  copy_parallel(std::span<const Triangle>(triangles), std::span(scene_.triangles).subspan(first, triangles.size()));
  forget_extents(mesh);
  end_update(timer);
}

/// Has the rest of the engine follow instances or meshes that have moved.
void Engine::end_update(const Timer& timer) {
  if (forest_) bvh_ = forest_->summary(), features_.tree = forest_->facts();
  late_.are_there([this] {
    for (const LateVertices& tree : late_trees_) tree.bring();
    if (forest_) bring_transforms();
  });
  const double tree_s = timer.seconds();
  make_renderers();
  update_.seconds = timer.seconds();
  update_.ready_s = update_.seconds - tree_s;
}

/// Builds the trees of meshes anew that are overdue. If there is no room for one, that at hand serves.
bool Engine::rebuild_meshes() {
  bool built = false;
  for (std::size_t i = 0; i < policies_.size(); ++i) {
    if (!policies_[i].overdue()) continue;
    built = true;
    if (tracer_->tree().built(i)) {
      rebuild_there(i);
      continue;
    }
    const std::span<const Triangle> triangles = forest_->meshes()[i].triangles;
    move_tree(i, {triangles.begin(), triangles.end()}, UpdateMode::Rebuild);
  }
  return built;
}

void Engine::set_transforms(std::span<const Transform> transforms) {
  if (!forest_) fail(Failure::Arguments, "scene '{}' has no instances; make one of meshes and instances", scene_.name);
  const Timer timer;
  std::vector<Transform> of_trees;
  if (forest_->size() != scene_.instances.placements.size()) {
    of_trees = transforms_of_trees(scene_, transforms);
    transforms = of_trees;
  }
  begin_update();
  tracer_->move_instances(transforms);
  end_update(timer);
}

/// Brings the transforms of the instances to the scene, and the bounds that follow from them.
void Engine::bring_transforms() {
  const std::vector<std::uint32_t> from = tree_layout(scene_).from;
  SceneInstances& all = scene_.instances;
  for (std::size_t i = 0; i < from.size(); ++i) {
    Placement& p = all.placements[from[i]];
    p.transform = forest_->transforms()[i];
    if (!is_identity(p.transform)) all.mesh_labels[p.mesh].in_world = false;
  }
  scene_.bounds = bounds_of_instances(scene_);
}

Triangle Engine::triangle(std::uint32_t prim) const {
  if (!forest_) return scene().triangles[prim];
  const Forest::Place place = forest_->place_of(prim);
  late_trees_[forest_->mesh_of(place.instance)].bring();
  return forest_->triangle(place);
}

std::uint64_t Engine::triangle_count() const { return ballot::triangle_count(scene_); }

}  // namespace ballot
