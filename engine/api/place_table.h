// Where the triangles of hits are: their meshes, instances and ids.
#pragma once

#include <algorithm>
#include <vector>

#include "engine/answer/columns.h"
#include "engine/answer/sums_there.h"
#include "engine/model/prim_ids.h"

namespace ballot::api {

/// The placements and ids of the triangles of a scene, by the prims of hits. Does not refer to the scene, and stays
/// right while placements and vertices move. Thread-safe.
class PlaceTable {
 public:
  /// The scene is finished: finish_scene().
  PlaceTable(const Scene& scene, IdSource source)
      : ids_(scene, source), meshes_(static_cast<std::uint32_t>(scene.instances.meshes())) {
    for (const PlacementLabel& label : scene.instances.placement_labels) number_.push_back(label.number);
    std::uint32_t prim = 0;
    for (const Placement& p : scene.instances.placements) {
      const auto count = static_cast<std::uint32_t>(scene.instances.triangles_of(p.mesh));
      first_.push_back(prim);
      mesh_.push_back(p.mesh);
      if (source != IdSource::Material) id_of_.push_back(count ? ids_.at(prim) : 0);
      prim += count;
    }
    first_.push_back(prim);
  }

  /// Returns the table for a device.
  PrimTable prim_table() const {
    PrimTable table{.words = {first_.begin(), first_.end() - 1},
                    .placements = static_cast<std::uint32_t>(number_.size())};
    table.words.insert(table.words.end(), number_.begin(), number_.end());
    table.words.insert(table.words.end(), id_of_.begin(), id_of_.end());
    table.words.resize(3 * number_.size());
    for (std::size_t i = 0; i < number_.size(); ++i)
      table.words.push_back(first_[i] < first_[i + 1] ? ids_.shift_of(first_[i]) : 0);
    if (!id_of_.empty()) return table;
    const std::vector<std::uint32_t> ranges = ids_.ranges();
    table.words.insert(table.words.end(), ranges.begin(), ranges.end());
    table.ranges = static_cast<std::uint32_t>(ranges.size() / 2);
    return table;
  }

  /// Returns the table of sums for a device.
  SumTable sum_table() const { return {{first_.begin(), first_.end() - 1}, mesh_, counts()}; }
  /// Returns the numbers of triangles, placements and meshes, by SumsBy.
  std::array<std::uint32_t, kSumsBy> counts() const {
    return {first_.back(), static_cast<std::uint32_t>(mesh_.size()), meshes_};
  }
  /// Returns the place of a placement's mesh among the meshes.
  std::uint32_t mesh_of(std::uint32_t placement) const { return mesh_[placement]; }

  /// Returns the placement of a triangle. `near` is tried first: neighbours often hit one.
  std::uint32_t placement_of(std::uint32_t prim, std::uint32_t near) const {
    if (prim >= first_[near] && prim < first_[near + 1]) return near;
    return static_cast<std::uint32_t>(std::ranges::upper_bound(first_, prim) - first_.begin()) - 1;
  }
  /// Returns the first triangle of a placement.
  std::uint32_t first_of(std::size_t placement) const { return first_[placement]; }
  /// Returns the number that a hit on a placement reports.
  std::uint32_t instance_of(std::uint32_t placement) const { return number_[placement]; }
  /// Returns the id of a triangle of a placement.
  std::uint32_t id_of(std::uint32_t prim, std::uint32_t placement) const {
    return id_of_.empty() ? ids_.at(prim) : id_of_[placement];
  }

 private:
  PrimIds ids_;
  std::uint32_t meshes_ = 0;
  std::vector<std::uint32_t> mesh_;    // of each placement
  std::vector<std::uint32_t> number_;  // the same
  std::vector<std::uint32_t> first_;   // triangle of each placement, and behind these their end
  std::vector<std::uint32_t> id_of_;   // each placement; none: its triangles have ids of their own
};

}  // namespace ballot::api
