// Vertices of meshes that move: an Engine is sent vertices for a tree that lies on the device, and makes triangles there.
#include <algorithm>

#include "engine/built_tree.h"
#include "engine/core/parallel.h"
#include "engine/core/stopwatch.h"

namespace ballot {

namespace {

MeshExtents united(const MeshExtents& a, const MeshExtents& b) {
  return {{glm::min(a.bounds.lo, b.bounds.lo), glm::max(a.bounds.hi, b.bounds.hi)},
          glm::max(a.largest_triangle, b.largest_triangle),
          false};
}

}  // namespace

/// Returns the tree that holds a triangle of the scene.
std::size_t Engine::tree_with(std::size_t triangle) const {
  if (!forest_) return 0;
  const Triangle* at = scene_.triangles.data() + triangle;
  const auto begin = [](const MeshTree& mesh) { return mesh.triangles.data(); };
  const auto next = std::ranges::upper_bound(forest_->meshes(), at, {}, begin);
  return std::size_t(next - forest_->meshes().begin()) - 1;
}

/// Returns the first triangle of a tree in the scene.
std::size_t Engine::first_of(std::size_t tree) const {
  return forest_ ? std::size_t(forest_->meshes()[tree].triangles.data() - scene_.triangles.data()) : 0;
}

bool Engine::takes_vertices(std::size_t first) const {
  return !scene_.animation && gpu_->info().float64 && tracer_->tree().built(tree_with(first));
}

/// Returns the extents of a tree's triangles once those of the mesh that begins with triangle `first` have changed.
/// Those of its other meshes are found at the first call.
MeshExtents Engine::extents_with(std::size_t tree, std::size_t first, const MeshExtents& moved) {
  const SceneInstances& all = scene_.instances;
  const std::size_t begin = first_of(tree), end = begin + tracer_->tree().built(tree)->triangles().size();
  MeshExtents whole = moved;
  for (auto m = std::size_t(std::ranges::lower_bound(all.first, begin) - all.first.begin());
       m < all.meshes() && all.first[m] < end; ++m) {
    const auto triangles = std::span(scene_.triangles).subspan(all.first[m], all.triangles_of(m));
    if (triangles.empty()) continue;
    if (all.first[m] == first) {
      mesh_extents_[first] = moved;
    } else {
      const auto [found, is_new] = mesh_extents_.try_emplace(all.first[m]);
      if (is_new)
        found->second = {bounds_of_vertices(triangles, scene_.name), extents_of({}, triangles).largest_triangle, false};
      whole = united(whole, found->second);
    }
  }
  return whole;
}

/// Forgets the extents of a tree's meshes, whose triangles have moved otherwise.
void Engine::forget_extents(std::size_t tree) {
  const std::size_t begin = first_of(tree), end = begin + forest_->meshes()[tree].triangles.size();
  mesh_extents_.erase(mesh_extents_.lower_bound(begin), mesh_extents_.lower_bound(end));
}

bool Engine::set_vertices(const MovedVertices& mesh, UpdateMode mode) {
  const Timer timer;
  gpu_->finish();
  const std::size_t tree = tree_with(mesh.first), first = first_of(tree);
  const std::shared_ptr<DeviceBuild> built = tracer_->tree().built(tree);
  IndexedTriangles& indexed = indexed_.try_emplace(tree, *gpu_, built->triangles().size()).first->second;
  const std::optional<MeshExtents> moved =
      indexed.write({mesh.first - first, mesh.triangles, mesh.corners, mesh.positions}, built->triangles());
  if (!moved) return false;
  begin_update();
  const auto before = mesh_extents_;
  const MeshExtents extents = extents_with(tree, mesh.first, *moved);
  try {
    follow_there(tree, indexed.triangles(), extents, mode);
  } catch (...) {
    mesh_extents_ = before;
    throw;
  }
  if (!forest_) scene_.bounds = extents.bounds;
  late_trees_[tree].are_there([this, built, first] {
    built->triangles().download(std::span(scene_.triangles).subspan(first, built->triangles().size()));
  });
  end_update(timer);
  return true;
}

/// Has a tree follow triangles on the device, which it takes in exchange for those of before. If it throws, the tree is
/// that of before again.
void Engine::follow_there(std::size_t tree, Buffer<Triangle>& triangles, const MeshExtents& extents, UpdateMode mode) {
  Timer timer;
  const std::shared_ptr<DeviceBuild> built = tracer_->tree().built(tree);
  const glm::vec3 largest_before = forest_ ? forest_->meshes()[tree].extents.largest_triangle : glm::vec3(0);
  RefitPolicy& policy = policies_[tree];
  const RefitPolicy before = policy;
  built->swap_triangles(triangles);
  try {
    update_.refitted = policy.wants_refit(mode) && tracer_->tree().refit(extents.bounds, tree);
    if (update_.refitted) {
      policy.refitted(timer.seconds(), built->summary().stats.sah);
      update_.refitted = mode != UpdateMode::Auto || !policy.regrets_refit();
      timer = {};
    }
    if (!update_.refitted) {
      built->rebuild();
      policy.built(timer.seconds(), built->summary().stats.sah);
    }
    take_there(tree, extents.largest_triangle, update_.refitted);
  } catch (const Error&) {
    policy = before;
    built->swap_triangles(triangles);
    built->rebuild();
    take_there(tree, largest_before, false);
    throw;
  }
}

/// Has all else follow a tree that has changed on the device.
void Engine::take_there(std::size_t tree, const glm::vec3& largest_triangle, bool refitted) {
  const std::shared_ptr<DeviceBuild> built = tracer_->tree().built(tree);
  if (forest_) {
    MeshTree now = forest_->meshes()[tree];
    now.bvh = std::make_shared<const Bvh>(built->summary());
    now.extents = {now.bvh->bounds, largest_triangle, now.bvh->is_empty()};
    tracer_->tree().change_mesh(tree, std::move(now), refitted);
  } else if (!refitted) {
    adopt({built->summary(), built});
  } else {
    bvh_ = built->summary();
    features_.tree = facts_of(bvh_);
    tracer_->moved(bvh_, scene_.triangles, features_.tree);
  }
}

/// Builds a tree of the forest anew where it lies.
void Engine::rebuild_there(std::size_t tree) {
  const Timer timer;
  begin_update();
  const std::shared_ptr<DeviceBuild> built = tracer_->tree().built(tree);
  built->rebuild();
  policies_[tree].built(timer.seconds(), built->summary().stats.sah);
  take_there(tree, forest_->meshes()[tree].extents.largest_triangle, false);
  end_update(timer);
}

}  // namespace ballot
