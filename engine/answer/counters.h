// The counters of the instrumented variant (RayStats in shaders/shared/variant.h), summed over rays, and ratios of
// them.
#pragma once

#include <cstdint>
#include <iterator>
#include <span>
#include <string_view>

#include "shaders/shared/variant.h"

namespace ballot {

/// A counter: its name in JSON, its field in the record of a ray, and what it counts.
struct CounterInfo {
  std::string_view name;
  std::uint32_t RayStats::*field;
  std::string_view what;
};
inline constexpr CounterInfo kCounters[] = {
    {"nodes", &RayStats::nodes, "inner nodes visited by live rays"},
    {"nodes_needed", &RayStats::nodes_needed, "of these, nodes that the ray itself meets"},
    {"leaves", &RayStats::leaves, "leaves visited by live rays"},
    {"leaves_needed", &RayStats::leaves_needed, "of these, leaves that the ray itself meets"},
    {"triangles", &RayStats::triangles, "triangles in the visited leaves"},
    {"triangles_tested", &RayStats::triangles_tested, "of these, triangles that the ray was tested against"},
    {"packet_nodes", &RayStats::packet_nodes, "of the nodes, those on a path that the subgroup shares"},
    {"lanes", &RayStats::lanes, "sum over the visits that a ray needs: the number of lanes that need the same visit"},
    {"steps", &RayStats::steps, "node and leaf visits of subgroups"},
    {"unneeded", &RayStats::unneeded, "shared node visits in which no lane could still find a nearer hit"},
    {"few", &RayStats::few, "shared node visits in which some lanes could, but fewer than a quarter"},
    {"votes", &RayStats::votes, "rounds of voting"},
    {"disagreements", &RayStats::disagreements, "of these, rounds in which lanes wanted different children first"},
    {"switches", &RayStats::switches,
     "nodes at which a shared path became paths of single rays; method cut: nodes put aside"},
    {"switch_depth", &RayStats::switch_depth, "sum of the depths of these nodes"},
    {"overflows", &RayStats::overflows,
     "method cut: pairs of children that the packet walks because the list of a lane is full"},
    {"fetches", &RayStats::fetches, "rays taken by idle lanes while other lanes were at work"},
};

/// The sums of all counters over rays.
struct Counters {
  std::uint64_t rays = 0;
  std::uint32_t subgroup = 0;  // lanes in a subgroup
  std::uint32_t stack = 0;     // the most entries over all rays: of the shared stack, or of a ray's stack and list
  std::uint64_t sums[std::size(kCounters)] = {};  // in the order of kCounters

  /// Adds the records of rays.
  void add(std::span<const RayStats> stats);
  /// Returns the sum of a counter. Throws Error(Arguments) if kCounters has no such name.
  std::uint64_t operator[](std::string_view name) const;

  /// Returns the mean share of a subgroup's lanes that needed a step, in [0, 1]; 0 if there were no steps.
  double active_lanes() const;
  /// Returns the share of node visits on shared paths, in [0, 1]; 0 if there were none.
  double packet_share() const;
  /// Returns the share of node visits that the ray itself needed, in [0, 1]; 0 if there were none. On shared paths it
  /// tells how alike neighbouring rays are. It is 1 where every ray walks by itself.
  double coherence() const;
};

}  // namespace ballot
