// Sums of the counters of the instrumented variant (RayStats in shaders/shared/variant.h), and figures made of them.
#pragma once

#include <cstdint>
#include <iterator>
#include <span>
#include <string_view>

#include "shaders/shared/variant.h"

namespace ballot {

/// A counter: its name in JSON, its field in the record, its meaning.
struct CounterInfo {
  std::string_view name;
  std::uint32_t RayStats::*field;
  std::string_view what;
};
inline constexpr CounterInfo kCounters[] = {
    {"nodes", &RayStats::nodes, "inner nodes that live rays went through"},
    {"nodes_needed", &RayStats::nodes_needed, "of them, met by the ray itself"},
    {"leaves", &RayStats::leaves, "leaves that live rays went through"},
    {"leaves_needed", &RayStats::leaves_needed, "of them, met by the ray itself"},
    {"triangles", &RayStats::triangles, "triangles in the leaves gone through"},
    {"triangles_tested", &RayStats::triangles_tested, "of them, tested: the ray met the leaf's box"},
    {"packet_nodes", &RayStats::packet_nodes, "of nodes, on a path that the subgroup shared"},
    {"lanes", &RayStats::lanes, "sum over needed visits of the lanes that needed the same visit"},
    {"steps", &RayStats::steps, "node and leaf visits of subgroups"},
    {"unneeded", &RayStats::unneeded, "shared node visits where no lane could still find a nearer hit"},
    {"few", &RayStats::few, "shared node visits where some lanes could, but fewer than a quarter"},
    {"votes", &RayStats::votes, "rounds of voting"},
    {"disagreements", &RayStats::disagreements, "of them, lanes wanted different children first"},
    {"switches", &RayStats::switches, "nodes at which paths changed from shared to own; of cut: nodes put aside"},
    {"switch_depth", &RayStats::switch_depth, "sum of their depths"},
    {"overflows", &RayStats::overflows, "pairs of children that a packet kept since some list was full"},
    {"fetches", &RayStats::fetches, "rays that idle lanes took while others were under way"},
};

struct Counters {
  std::uint64_t rays = 0;
  std::uint32_t subgroup = 0;  // lanes
  std::uint32_t stack = 0;     // high-water mark over all rays, of the shared or the own stack with its list
  std::uint64_t sums[std::size(kCounters)] = {};  // in the order of kCounters

  void add(std::span<const RayStats> stats);
  std::uint64_t operator[](std::string_view name) const;  // a name of kCounters

  /// Mean share of a subgroup's lanes that needed a step, in [0, 1]; 0 without steps.
  double active_lanes() const;
  /// Share of node visits on shared paths, in [0, 1].
  double packet_share() const;
  /// Share of node visits that the ray itself needed, in [0, 1]: how alike neighbouring rays are.
  double coherence() const;
};

}  // namespace ballot
