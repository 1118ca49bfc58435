// Meshes and instances that move: a DeviceScene whose trees follow, all of them or none.
#include <algorithm>
#include <list>
#include <set>

#include "engine/core/parallel.h"
#include "engine/core/stopwatch.h"
#include "engine/model/instances.h"
#include "engine/model/mesh_vertices.h"
#include "engine/scene/scene_tree.h"
#include "engine/tree/host/refit.h"

namespace ballot {

/// A tree whose triangles move, in the place where it lies.
struct DeviceScene::TreeMove {
  std::size_t tree;
  MeshExtents extents;                // of the moved triangles
  Buffer<Triangle>* there = nullptr;  // the moved triangles, in exchange for those of before; null: `here`
  UnsetVector<Triangle> here = {};
  std::optional<Buffer<Triangle>> sent = {};          // what `there` is if the host has sent them
  bool same_area = true;                              // of `here`: no triangle gains or loses its area
  std::vector<MovedVertices> asked = {};              // whose extents the device has not told yet
  std::map<std::size_t, MeshExtents> of_meshes = {};  // that share the tree, by their first triangles
  // Of the tree that has followed:
  std::optional<RefitPolicy> before = {};  // how it was; none: it has not begun to follow
  Bounds bounds_before = {};
  MeshTree now = {};
  bool refitted = false, is_new = false;  // is_new: there, a build has begun
};

namespace {

MeshExtents united(const MeshExtents& a, const MeshExtents& b) {
  return {{glm::min(a.bounds.lo, b.bounds.lo), glm::max(a.bounds.hi, b.bounds.hi)},
          glm::max(a.largest_triangle, b.largest_triangle),
          false};
}

void check(const MovedVertices& mesh) { check_vertices(mesh.positions, fmt::format("mesh {}", mesh.number)); }

/// Meshes whose vertices the host has. Those that lie on the device are read back.
struct OnHost {
  explicit OnHost(std::span<const MovedVertices> moved) : meshes(moved.begin(), moved.end()) {
    for (MovedVertices& m : meshes)
      if (m.there) m.positions = read.emplace_back(read_vertices(*m.there));
  }
  std::vector<MovedVertices> meshes;
  std::list<std::vector<glm::vec3>> read = {};
};

/// Returns true if a refit for a longest side of `guess` has to be done again: costs by the SAH may have left the range
/// of float32.
bool is_far(const Bounds& guess, const Bounds& truth) {
  const auto longest = [](const Bounds& b) {
    const glm::vec3 sides = b.hi - b.lo;
    return std::max({sides.x, sides.y, sides.z});
  };
  constexpr float kFar = 16;
  return !(longest(truth) <= kFar * longest(guess) && longest(guess) <= kFar * longest(truth));
}

}  // namespace

/// Returns the tree that holds a triangle of the scene.
std::size_t DeviceScene::tree_with(std::size_t triangle) const {
  if (!forest_) return 0;
  const Triangle* at = scene_.triangles.data() + triangle;
  const auto begin = [](const MeshTree& mesh) { return mesh.triangles.data(); };
  const auto next = std::ranges::upper_bound(forest_->meshes(), at, {}, begin);
  return std::size_t(next - forest_->meshes().begin()) - 1;
}

/// Returns the first triangle of a tree in the scene.
std::size_t DeviceScene::first_of(std::size_t tree) const {
  return forest_ ? std::size_t(forest_->meshes()[tree].triangles.data() - scene_.triangles.data()) : 0;
}

/// Returns true if the device makes the triangles of a tree's meshes of their vertices: the tree is there, and the
/// device can tell which triangles have an area. Trees that keep those that float32 rounds flat are the host's.
bool DeviceScene::takes_vertices(std::size_t tree) const {
  return !scene_.animation && !build_.keeps_flat && gpu_->info().float64 && tracer_->tree().built(tree);
}

bool DeviceScene::reads_vertices_there(std::size_t mesh) const {
  return takes_vertices(tree_with(scene_.instances.first[mesh]));
}

/// Returns the meshes of a tree that have not moved and whose extents nobody has found yet, as if they moved to where
/// they are.
std::vector<MovedVertices> DeviceScene::unknown_in(std::size_t tree, std::span<const MovedVertices> moved) const {
  const std::shared_ptr<DeviceBuild> built = tracer_->tree().built(tree);
  const SceneInstances& all = scene_.instances;
  const std::size_t begin = first_of(tree), end = begin + built->triangles().size();
  std::set<std::size_t> known;
  for (const MovedVertices& m : moved) known.insert(m.first);
  std::vector<MovedVertices> still;
  for (auto m = std::size_t(std::ranges::lower_bound(all.first, begin) - all.first.begin());
       m < all.meshes() && all.first[m] < end; ++m) {
    const std::size_t first = all.first[m], count = all.triangles_of(m);
    if (count == 0 || mesh_extents_.contains(first) || known.contains(first)) continue;
    MovedVertices& same = still.emplace_back();
    same.first = first, same.triangles = count, same.mesh = m, same.number = all.mesh_labels[m].number;
    DeviceVertices& there = same.there.emplace();
    there.buffer = {built, &built->triangles()};
    there.offset = (first - begin) * sizeof(Triangle);
    there.count = 3 * count;
  }
  return still;
}

/// Has the device make the triangles of meshes of one tree, or makes them here, and changes nothing else. Throws
/// Error(Arguments) if a vertex of the latter cannot be.
DeviceScene::TreeMove DeviceScene::prepare_move(std::size_t tree, std::span<const MovedVertices> meshes) {
  TreeMove move{.tree = tree, .extents = {}};
  const std::size_t first = first_of(tree);
  if (takes_vertices(tree)) {
    const std::shared_ptr<DeviceBuild> built = tracer_->tree().built(tree);
    IndexedTriangles& indexed = indexed_.try_emplace(tree, *gpu_, built->triangles().size()).first->second;
    move.asked.assign(meshes.begin(), meshes.end());
    for (MovedVertices& m : unknown_in(tree, meshes)) move.asked.push_back(std::move(m));
    std::vector<MovedVertices> in_tree = move.asked;
    for (MovedVertices& m : in_tree) m.first -= first;
    indexed.record(in_tree, built->triangles());
    move.there = &indexed.triangles();
    return move;
  }
  const OnHost here(meshes);
  for (const MovedVertices& m : here.meshes) check(m);
  late_.parts[tree].bring();
  const MeshTree& old = forest_->meshes()[tree];
  move.here.assign(old.triangles.begin(), old.triangles.end());
  for (const MovedVertices& m : here.meshes)
    expand(m.corners, m.positions, std::span(move.here).subspan(m.first - first, m.triangles));
  take_here(move);
  return move;
}

/// Takes what the device has found of the vertices of a move. Waits. Throws Error(Arguments) if one cannot be.
void DeviceScene::take_found(TreeMove& move) {
  if (move.asked.empty()) return;
  const std::vector<IndexedTriangles::Found> found = indexed_.at(move.tree).found();
  for (std::size_t i = 0; i < found.size(); ++i) {
    check_found(move.asked[i], found[i], fmt::format("mesh {}", move.asked[i].number), gpu_->info());
    move.of_meshes[move.asked[i].first] = found[i].extents;
  }
  move.asked.clear();
  move.extents = move.of_meshes.begin()->second;
  for (const auto& [first, extents] : move.of_meshes) move.extents = united(move.extents, extents);
  const std::size_t begin = first_of(move.tree), end = begin + tracer_->tree().built(move.tree)->triangles().size();
  for (auto at = mesh_extents_.lower_bound(begin); at != mesh_extents_.lower_bound(end); ++at)
    if (!move.of_meshes.contains(at->first)) move.extents = united(move.extents, at->second);
}

/// Completes a move of triangles that the host has. If the tree lies on the device they are sent there.
void DeviceScene::take_here(TreeMove& move) {
  const MeshTree& old = forest_->meshes()[move.tree];
  const MovedTriangles moved = check_moved(old.triangles, old.bvh->stats.degenerate, move.here, scene_.name);
  move.same_area = moved.same_area;
  if (!old.there || build_.keeps_flat) return;
  move.extents = {moved.bounds, extents_of({}, move.here).largest_triangle, false};
  move.there = &move.sent.emplace(DeviceBuilder::upload(*gpu_, move.here));
}

/// Refits a tree on the device to triangles that lie there. What the device finds of their vertices is read afterwards,
/// so that the host waits once: until then the tree's old size stands for the new one.
bool DeviceScene::refit_there(TreeMove& move) {
  DeviceTree& tree = tracer_->tree();
  if (move.asked.empty()) return tree.refit(move.extents.bounds, move.tree);
  const Bounds guess = tree.built(move.tree)->summary().bounds;
  const bool sound = tree.refit(guess, move.tree);
  take_found(move);
  const Bounds truth = tree.built(move.tree)->summary().bounds;
  return sound && (!is_far(guess, truth) || tree.refit(truth, move.tree));
}

/// Has a tree on the device follow triangles that lie there.
void DeviceScene::follow_there(TreeMove& move, UpdateMode mode) {
  Timer timer;
  const std::shared_ptr<DeviceBuild> built = tracer_->tree().built(move.tree);
  RefitPolicy& policy = policies_[move.tree];
  move.before = policy;
  move.bounds_before = built->summary().bounds;
  built->swap_triangles(*move.there);
  move.refitted = policy.wants_refit(mode) && refit_there(move);
  if (move.refitted) {
    policy.refitted(timer.seconds(), built->summary().stats.sah);
    move.refitted = mode != UpdateMode::Auto || !policy.regrets_refit();
    timer = {};
  }
  if (move.refitted) return;
  move.is_new = true;
  built->rebuild();
  policy.built(timer.seconds(), built->summary().stats.sah);
}

/// Makes a tree of a forest follow triangles on the host.
void DeviceScene::follow_here(TreeMove& move, UpdateMode mode) {
  const Timer timer;
  RefitPolicy& policy = policies_[move.tree];
  move.before = policy;
  const MeshTree& old = forest_->meshes()[move.tree];
  if (move.same_area && policy.wants_refit(mode)) {
    Bvh tree = *old.bvh;
    refit_bvh(tree, move.here, build_);
    policy.refitted(timer.seconds(), tree.stats.sah);
    move.refitted = mode != UpdateMode::Auto || !policy.regrets_refit();
    if (move.refitted) move.now = make_mesh_tree(move.here, std::move(tree));
  }
  if (!move.refitted) {
    std::unique_ptr<DeviceBuild> scratch;
    move.now = build_mesh(*gpu_, move.here, build_, false, {}, scratch);
    policy.built(timer.seconds(), move.now.bvh->stats.sah);
  }
  move.now.triangles = old.triangles;
}

/// Has all else follow trees that have followed their triangles, and the instances of a forest their transforms.
void DeviceScene::take_moves(std::span<TreeMove> moves, const MovedTransforms& transforms) {
  if (forest_) {
    std::vector<DeviceTree::MeshChange> changes;
    for (TreeMove& m : moves) {
      if (m.there) {
        m.now = forest_->meshes()[m.tree];
        m.now.bvh = std::make_shared<Bvh>(tracer_->tree().built(m.tree)->summary());
        m.now.extents = {m.now.bvh->bounds, m.extents.largest_triangle, m.now.bvh->is_empty()};
      }
      changes.push_back({m.tree, std::move(m.now), m.refitted});
    }
    tracer_->tree().change_meshes(changes, transforms);
    return;
  }
  const std::shared_ptr<DeviceBuild> built = tracer_->tree().built();
  if (!moves[0].refitted) return adopt({built->summary(), built});
  bvh_ = built->summary();
  features_.tree = facts_of(bvh_);
  tracer_->moved(bvh_, scene_.triangles, features_.tree);
}

/// Has trees follow their triangles, and instances their transforms. If it throws, all is as it was: trees on the
/// device are refitted to the triangles of before, or built again if others have been built.
void DeviceScene::apply_moves(std::span<TreeMove> moves, const MovedTransforms& transforms, UpdateMode mode) {
  std::vector<glm::vec3> largest;
  for (const TreeMove& m : moves)
    largest.push_back(forest_ ? forest_->meshes()[m.tree].extents.largest_triangle : glm::vec3(0));
  try {
    for (TreeMove& m : moves) m.there ? follow_there(m, mode) : follow_here(m, mode);
    take_moves(moves, transforms);
  } catch (...) {
    std::vector<TreeMove> back;
    for (std::size_t i = 0; i < moves.size(); ++i) {
      const TreeMove& m = moves[i];
      if (!m.before) continue;
      policies_[m.tree] = *m.before;
      if (!m.there) continue;
      const std::shared_ptr<DeviceBuild> built = tracer_->tree().built(m.tree);
      built->swap_triangles(*m.there);
      const bool refitted = !m.is_new && tracer_->tree().refit(m.bounds_before, m.tree);
      if (!refitted) built->rebuild();
      back.push_back({.tree = m.tree, .extents = {{}, largest[i], false}, .there = m.there, .refitted = refitted});
    }
    if (!back.empty()) take_moves(back, {});
    throw;
  }
}

/// Tells that the triangles of a tree lie with it, on the device, and those of the host are others.
void DeviceScene::triangles_are_there(std::size_t tree) {
  late_.parts[tree].is_elsewhere([this, built = tracer_->tree().built(tree), first = first_of(tree)] {
    built->triangles().download(std::span(scene_.triangles).subspan(first, built->triangles().size()));
  });
}

/// Tells that trees have moved, and that the host's triangles follow, or are there.
void DeviceScene::end_moves(std::span<TreeMove> moves) {
  for (TreeMove& m : moves) {
    const std::size_t first = first_of(m.tree);
    if (m.here.empty()) {
      for (const auto& [mesh, extents] : m.of_meshes) mesh_extents_[mesh] = extents;
      triangles_are_there(m.tree);
      continue;
    }
    copy_parallel(std::span<const Triangle>(m.here), std::span(scene_.triangles).subspan(first, m.here.size()));
    mesh_extents_.erase(mesh_extents_.lower_bound(first), mesh_extents_.lower_bound(first + m.here.size()));
  }
}

/// Moves meshes and instances as a change says.
void DeviceScene::move_all(const SceneChange& change, UpdateMode mode) {
  const Timer timer;
  gpu_->finish();
  count_walks();
  std::map<std::size_t, std::vector<MovedVertices>> by_tree;
  for (const MovedVertices& m : change.vertices) by_tree[tree_with(m.first)].push_back(m);
  std::vector<TreeMove> moves;
  for (const auto& [tree, meshes] : by_tree) moves.push_back(prepare_move(tree, meshes));
  // A refit that turns out to be of bad vertices is undone. A build has to know them.
  const auto refits = [&](const TreeMove& move) { return policies_[move.tree].wants_refit(mode); };
  if (!std::ranges::all_of(moves, refits))
    for (TreeMove& move : moves) take_found(move);
  std::vector<Transform> of_trees;
  MovedTransforms transforms = change.transforms;
  if (forest_ && forest_->size() != scene_.instances.placements.size()) {  // else each placement has a tree of its own
    if (!transforms.here.empty())
      for (const std::uint32_t from : tree_layout(scene_).from) of_trees.push_back(transforms.here[from]);
    transforms = of_trees;
  }
  forget_shape();
  apply_moves(moves, transforms, mode);
  update_.refitted = !moves.empty() && std::ranges::all_of(moves, &TreeMove::refitted);
  if (!forest_) scene_.bounds = moves[0].extents.bounds;
  end_moves(moves);
  end_update(timer);
}

/// Moves the meshes of a flat scene whose tree the host has.
void DeviceScene::move_flat(std::span<const MovedVertices> meshes, UpdateMode mode) {
  const OnHost here(meshes);
  for (const MovedVertices& m : here.meshes) check(m);
  UnsetVector<Triangle> moved = std::move(spare_triangles_);
  moved.resize(scene().triangles.size());
  copy_parallel(std::span<const Triangle>(scene_.triangles), std::span(moved));
  for (const MovedVertices& m : here.meshes)
    expand(m.corners, m.positions, std::span(moved).subspan(m.first, m.triangles));
  spare_triangles_ = move(std::move(moved), mode);
}

/// Has the tree of a flat scene follow triangles on the device, which it takes in exchange for those of before.
void DeviceScene::follow_posed(Buffer<Triangle>& triangles, const Bounds& bounds, UpdateMode mode) {
  TreeMove move{.tree = 0, .extents = {.bounds = bounds}, .there = &triangles};
  apply_moves(std::span(&move, 1), {}, mode);
  update_.refitted = move.refitted;
}

/// Builds a tree of the forest anew.
void DeviceScene::rebuild(std::size_t tree) {
  const Timer timer;
  begin_update();
  TreeMove move{.tree = tree, .extents = forest_->meshes()[tree].extents};
  const Timer of_build;
  if (const std::shared_ptr<DeviceBuild> built = tracer_->tree().built(tree)) {
    built->rebuild();
    move.now = forest_->meshes()[tree];
    move.now.bvh = std::make_shared<Bvh>(built->summary());
  } else {
    std::unique_ptr<DeviceBuild> scratch;
    late_.parts[tree].bring();
    move.now = build_mesh(*gpu_, forest_->meshes()[tree].triangles, build_, false, {}, scratch);
  }
  const double sah = move.now.bvh->stats.sah;
  take_moves(std::span(&move, 1), {});
  policies_[tree].built(of_build.seconds(), sah);
  end_update(timer);
}

}  // namespace ballot
