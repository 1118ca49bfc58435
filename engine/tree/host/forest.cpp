#include "engine/tree/host/forest.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/parallel.h"
#include "engine/tree/host/build.h"

namespace ballot {
namespace {

std::uint64_t next_exchange() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

/// Counts the tree of a mesh among those of a forest, or no longer.
void add(BvhStats& sum, const BvhStats& mesh) {
  sum.triangles += mesh.triangles;
  sum.degenerate += mesh.degenerate;
  sum.references += mesh.references;
  sum.nodes += mesh.nodes;
  sum.leaves += mesh.leaves;
  sum.bytes += mesh.bytes;
  sum.build_s += mesh.build_s;
  sum.depth = std::max(sum.depth, mesh.depth);
  sum.largest_leaf = std::max(sum.largest_leaf, mesh.largest_leaf);
  sum.builder = mesh.builder;
}

void take_away(BvhStats& sum, const BvhStats& mesh) {
  sum.triangles -= mesh.triangles;
  sum.degenerate -= mesh.degenerate;
  sum.references -= mesh.references;
  sum.nodes -= mesh.nodes;
  sum.leaves -= mesh.leaves;
  sum.bytes -= mesh.bytes;
  sum.build_s -= mesh.build_s;
}

void add(TreeFacts& all, const TreeFacts& own) {
  all.depth = std::max(all.depth, own.depth);
  all.largest_leaf = std::max(all.largest_leaf, own.largest_leaf);
  all.far |= own.far;
}

}  // namespace

MeshTree make_mesh_tree(std::span<const Triangle> triangles, Bvh bvh) {
  const MeshExtents extents = extents_of(bvh, triangles);
  return {triangles, std::make_shared<Bvh>(std::move(bvh)), extents};
}

Forest::Forest(std::vector<MeshTree> meshes, std::span<const Placement> placements, InstanceNumbers numbers)
    : meshes_(std::move(meshes)),
      first_of_(std::move(numbers.prims)),
      names_(std::move(numbers.names)),
      exchanges_(next_exchange()) {
  place(placements);
}

Forest::Forest(std::vector<UnsetVector<Triangle>> meshes, std::span<const Placement> placements, const BuildMesh& build)
    : own_(std::move(meshes)), exchanges_(next_exchange()) {
  for (const UnsetVector<Triangle>& triangles : own_) meshes_.push_back(make_mesh_tree(triangles, build(triangles)));
  place(placements);
}

void Forest::place(std::span<const Placement> placements) {
  for (std::size_t i = 0; i < placements.size(); ++i) {
    if (placements[i].mesh >= meshes_.size())
      fail(Failure::Arguments, "instance {}: its mesh is number {}, but there are {} meshes", i, placements[i].mesh,
           meshes_.size());
    mesh_of_.push_back(placements[i].mesh);
    transforms_.push_back(placements[i].transform);
  }
  if (std::ranges::any_of(placements, [](const Placement& p) { return p.group != kSharedGroup; }))
    for (const Placement& p : placements) groups_.push_back(p.group);
  number();
  count();
  std::vector<Instance> made = placed(transforms_);
  TopTree top = build_top(made, meshes_, groups_);
  set(std::move(made), std::move(top));
}

/// Numbers the triangles through the instances, unless they have numbers.
void Forest::number() {
  if (!first_of_.empty()) {
    count_ = first_of_.back();
    first_of_.pop_back();
    return;
  }
  for (std::size_t i = 0; i < mesh_of_.size(); ++i) {
    first_of_.push_back(std::uint32_t(count_));
    count_ += meshes_[mesh_of_[i]].triangles.size();
    if (count_ > kMostPrims)
      fail(Failure::Arguments,
           "instance {}: with it the scene has {} triangles, counted through its instances; at most {} can be numbered",
           i, count_, kMostPrims);
  }
}

void Forest::check_count(std::span<const Transform> transforms) const {
  if (transforms.size() != mesh_of_.size())
    fail(Failure::Arguments, "{} transforms, but the scene has {} instances; expected one for each", transforms.size(),
         mesh_of_.size());
}

MeshTree Forest::exchange(std::size_t mesh, MeshTree with) {
  exchanges_ = next_exchange();
  reshaped_ |= with.extents.empty != meshes_[mesh].extents.empty;
  MeshTree old = std::exchange(meshes_[mesh], std::move(with));
  const Bvh& now = *meshes_[mesh].bvh;
  const TreeFacts before = facts_of(*old.bvh), after = facts_of(now);
  if (after.depth >= before.depth && after.largest_leaf >= before.largest_leaf && after.far >= before.far) {
    take_away(sum_, old.bvh->stats);
    add(sum_, now.stats);
    add(tree_facts_, after);
    sahs_[mesh] = now.stats.sah;
  } else {  // the mesh may have been the one that had the most
    count();
  }
  changed_.push_back(mesh);
  return old;
}

/// Sums up the trees of all meshes.
void Forest::count() {
  sum_ = {};
  tree_facts_ = {};
  sahs_.clear();
  std::uint32_t kinds = 0;
  for (const MeshTree& mesh : meshes_) kinds |= 1u << std::uint32_t(mesh.kind);
  constexpr std::uint32_t kTrianglesAlone = 1u << SHAPE_TRIANGLE;
  tree_facts_.shapes = kinds == kTrianglesAlone ? 0 : kinds;
  for (const MeshTree& mesh : meshes_) {
    add(sum_, mesh.bvh->stats);
    add(tree_facts_, facts_of(*mesh.bvh));
    sahs_.push_back(mesh.bvh->stats.sah);
  }
}

void Forest::move(std::span<const Transform> transforms) {
  check_count(transforms);
  std::vector<Instance> moved = placed(transforms);
  std::vector<Transform> kept(transforms.begin(), transforms.end());
  if (!reshaped_) refit_top(top_, moved);
  if (!reshaped_ && top_.cost <= kMostTopDecay * top_.built_cost) {
    set(std::move(moved), std::move(top_));
  } else {
    try {
      TopTree built = build_top(moved, meshes_, groups_);
      set(std::move(moved), std::move(built));
    } catch (...) {
      if (!reshaped_) refit_top(top_, instances_);
      throw;
    }
    reshaped_ = false;
  }
  transforms_ = std::move(kept);
  transforms_late_ = false;
}

/// Returns the instances where transforms put them. Where these are the forest's own, only those of meshes that have
/// changed are placed.
std::vector<Instance> Forest::placed(std::span<const Transform> transforms) const {
  constexpr std::size_t kFewMeshes = 8;
  const bool few = transforms.data() == transforms_.data() && !late_ && instances_.size() == mesh_of_.size() &&
                   changed_.size() < kFewMeshes;
  std::vector<Instance> made = few ? instances_ : std::vector<Instance>(mesh_of_.size());
  for_chunks(made.size(), 1 << 10, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (few && std::ranges::count(changed_, mesh_of_[i]) == 0) continue;
      made[i] = place_instance(meshes_[mesh_of_[i]].extents, transforms[i], name_of(i));
      made[i].mesh = mesh_of_[i];
      made[i].first = first_of_[i];
    }
  });
  return made;
}

void Forest::set(std::vector<Instance> instances, TopTree top) {
  instances_ = std::move(instances);
  top_ = std::move(top);
  facts_ = top_;
  late_ = false;
  changed_.clear();
  summarize();
}

void Forest::moved_elsewhere(std::span<const Transform> transforms, const TopFacts& top) {
  if (!transforms.empty()) {
    if (transforms.data() != transforms_.data()) copy_parallel(transforms, std::span(transforms_));
    transforms_late_ = false;
  }
  moved(top);
}

void Forest::moved_elsewhere(std::function<void(std::span<Transform>)> read, const TopFacts& top) {
  read_transforms_ = std::move(read);
  transforms_late_ = true;
  moved(top);
}

void Forest::moved(const TopFacts& top) {
  facts_ = top;
  late_ = true;
  changed_.clear();
  reshaped_ = false;
  summarize();
}

void Forest::bring() const {
  if (!late_) return;
  const std::lock_guard lock(bringing_);
  if (!late_) return;
  std::vector<Instance> made = placed(transforms());
  top_ = build_top(made, meshes_, groups_);
  instances_ = std::move(made);
  late_ = false;
}

void Forest::bring_transforms() const {
  if (!transforms_late_) return;
  const std::lock_guard lock(bringing_transforms_);
  if (!transforms_late_) return;
  read_transforms_(transforms_);
  transforms_late_ = false;
}

void Forest::summarize() {
  summary_.bounds = facts_.bounds;
  summary_.stats = sum_;
  summary_.stats.build_s += facts_.build_s;
}

TreeFacts Forest::facts() const {
  TreeFacts facts = tree_facts_;
  facts.top_depth = std::max(facts_.depth, 1u);
  return facts;
}

std::vector<double> Forest::walk_shares() const {
  std::vector<double> shares(meshes_.size());
  double sum = 0;
  for (std::size_t i = 0; i < mesh_of_.size(); ++i) {
    const MeshTree& mesh = meshes_[mesh_of_[i]];
    if (mesh.extents.empty) continue;
    const glm::vec3 size = mesh.extents.bounds.hi - mesh.extents.bounds.lo;
    glm::vec3 moved(0);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) moved[r] += std::abs(transforms_[i].m[r][c]) * size[c];
    const double share = half_area(glm::vec3(0), moved) * sahs_[mesh_of_[i]];
    shares[mesh_of_[i]] += share;
    sum += share;
  }
  for (double& share : shares) share = sum > 0 ? share / sum : 0;
  return shares;
}

std::uint64_t Forest::triangle_count() const { return count_; }

Forest::Place Forest::place_of(std::uint32_t prim) const {
  // The last instance that begins at or before it; those without triangles begin where the next one does.
  const auto next = std::ranges::upper_bound(first_of_, prim);
  const auto instance = std::uint32_t(next - first_of_.begin() - 1);
  return {instance, prim - first_of_[instance]};
}

std::optional<glm::vec3> Forest::shape_normal(const Place& place, float u, float v) const {
  if (meshes_[mesh_of_[place.instance]].kind == ShapeKind::Triangles) return {};
  return normal_of_shape(u, v, transforms()[place.instance]);
}

Triangle Forest::triangle(const Place& place) const {
  const Transform& t = transforms()[place.instance];
  const Triangle& given = meshes_[mesh_of_[place.instance]].triangles[place.triangle];
  Triangle moved;
  for (int k = 0; k < 3; ++k) {
    const glm::dvec3 v = given[std::size_t(k)];
    for (int r = 0; r < 3; ++r)
      moved[std::size_t(k)][r] =
          float(double(t.m[r][0]) * v.x + double(t.m[r][1]) * v.y + double(t.m[r][2]) * v.z + double(t.m[r][3]));
  }
  return moved;
}

}  // namespace ballot
