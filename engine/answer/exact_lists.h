// The host's part of mode exact: rays that the device leaves open, and the order of all crossings. Internal to
// engine/answer.
#pragma once

#include <span>
#include <vector>

#include "engine/answer/crossing_kernels.h"
#include "engine/oracle/crossings.h"

namespace ballot {

/// The exact crossings of rays with a tree, as a query asks for them. put_in_order() is thread-safe.
class ExactLists {
 public:
  /// Keeps references to the tree, its arrays and to the query's masks.
  ExactLists(DeviceTree& tree, const CrossingQuery& query)
      : tree_(tree), oracle_(tree.oracle_scene()), query_(query), judge_(tree.forest(), query.triangle_masks) {}

  /// Replaces each count that is UNSURE by the exact one, on all cores.
  void count(std::span<const Ray> rays, const FilterWords& words, std::span<std::uint32_t> counts) const;
  /// Returns the crossings of each ray, in order. Finds them on all cores.
  std::vector<std::vector<Hit>> lists(const ListPart<Ray>& rays) const;
  /// Puts all crossings of a ray into the exact order, with the oracle's t, u and v.
  void put_in_order(const Ray& ray, std::vector<Hit>& hits) const;

 private:
  std::vector<ExactCrossing> find(const Ray& ray, const FilterWords& words, std::size_t i) const;
  Ray walked(const Ray& ray) const;
  std::vector<Hit> hits_of(const std::vector<ExactCrossing>& crossings) const;

  DeviceTree& tree_;
  ExactCrossings oracle_;
  CrossingQuery query_;
  FilterJudge judge_;
};

}  // namespace ballot
