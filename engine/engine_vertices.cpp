// Vertices of meshes that move: an Engine whose tree lies on the device is sent vertices, and makes triangles there.
#include <algorithm>

#include "engine/built_tree.h"
#include "engine/core/parallel.h"
#include "engine/core/stopwatch.h"

namespace ballot {

bool Engine::takes_vertices() const {
  return !forest_ && !scene_.animation && tracer_->tree().built() && gpu_->info().float64;
}

/// Returns the bounds of the scene once those of a mesh have changed. Those of the others are found at the first call.
Bounds Engine::bounds_with(std::size_t first, const Bounds& bounds) {
  const SceneInstances& all = scene_.instances;
  if (mesh_bounds_.empty())
    for (std::size_t m = 0; m < all.meshes(); ++m)
      mesh_bounds_.push_back(
          bounds_of_vertices(std::span(scene_.triangles).subspan(all.first[m], all.triangles_of(m)), scene_.name));
  Bounds whole = bounds;
  for (std::size_t m = 0; m < all.meshes(); ++m) {
    if (all.triangles_of(m) == 0) continue;
    if (all.first[m] == first) mesh_bounds_[m] = bounds;
    whole = {glm::min(whole.lo, mesh_bounds_[m].lo), glm::max(whole.hi, mesh_bounds_[m].hi)};
  }
  return whole;
}

bool Engine::set_vertices(const MovedVertices& mesh, UpdateMode mode) {
  const Timer timer;
  gpu_->finish();
  if (!indexed_) {
    late_.bring();
    indexed_ = std::make_unique<IndexedTriangles>(*gpu_, scene_.triangles.size());
  }
  const std::optional<Bounds> moved = indexed_->write(mesh, tracer_->tree().built()->triangles());
  if (!moved) return false;
  begin_update();
  const std::vector<Bounds> before = mesh_bounds_;
  const Bounds bounds = bounds_with(mesh.first, *moved);
  try {
    follow_there(indexed_->triangles(), bounds, mode);
  } catch (...) {
    mesh_bounds_ = before;
    throw;
  }
  scene_.bounds = bounds;
  late_.are_there([this] { tracer_->tree().built()->triangles().download(scene_.triangles); });
  const double tree_s = timer.seconds();
  make_renderers();
  update_.seconds = timer.seconds();
  update_.ready_s = update_.seconds - tree_s;
  return true;
}

}  // namespace ballot
