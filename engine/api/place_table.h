// Where the triangles of hits are: their meshes, instances and ids.
#pragma once

#include <algorithm>
#include <vector>

#include "engine/scene/prim_ids.h"

namespace ballot::api {

/// The placements and ids of the triangles of a scene, by the prims of hits. Does not refer to the scene, and stays
/// right while placements and vertices move. Thread-safe.
class PlaceTable {
 public:
  /// The scene is finished: finish_scene().
  PlaceTable(const Scene& scene, IdSource ids) : ids_(scene, ids), instanced_(scene.instanced()) {
    std::size_t prim = 0;
    for (const Placement& p : scene.instances.placements) {
      first_.push_back(static_cast<std::uint32_t>(prim));
      prim += scene.instances.triangles_of(p.mesh);
    }
    first_.push_back(static_cast<std::uint32_t>(prim));
  }

  /// Returns the placement of a triangle. `near` is tried first: neighbours often hit one.
  std::uint32_t placement_of(std::uint32_t prim, std::uint32_t near) const {
    if (prim >= first_[near] && prim < first_[near + 1]) return near;
    return static_cast<std::uint32_t>(std::ranges::upper_bound(first_, prim) - first_.begin()) - 1;
  }
  /// Returns the first triangle of a placement.
  std::uint32_t first_of(std::size_t placement) const { return first_[placement]; }
  /// Returns the number that a hit on a placement reports: 0 in flat scenes.
  std::uint32_t instance_of(std::uint32_t placement) const { return instanced_ ? placement : 0; }
  std::uint32_t id_of(std::uint32_t prim) const { return ids_.at(prim); }

 private:
  PrimIds ids_;
  bool instanced_;
  std::vector<std::uint32_t> first_;  // triangle of each placement, and behind these their end
};

}  // namespace ballot::api
