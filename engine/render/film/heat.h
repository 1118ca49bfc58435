// Heat maps: where in a picture a traversal method works, and how.
#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <span>
#include <string_view>
#include <vector>

#include "engine/core/image.h"
#include "shaders/shared/variant.h"

namespace ballot {

/// What a heat map shows: a count, or one over the sum of others. All are EXR channels stats.<name>.
struct HeatKind {
  using Field = std::uint32_t RayStats::*;
  std::string_view name;
  Field count;
  Field over[2];  // null: nothing. Without any it is a count, which grows with the samples
  std::string_view what;

  bool ratio() const { return over[0] != nullptr; }
  float value(const RayStats& sum_over_samples) const;  // 0 over 0 is 0
  /// What the last colour stands for where that does not depend on the picture: the subgroup's size for lanes, 1 for
  /// other shares; 0 for counts.
  float fixed_top(std::uint32_t subgroup) const;
};
inline constexpr HeatKind kHeatKinds[] = {
    {"nodes", &RayStats::nodes, {nullptr, nullptr}, "inner nodes that the ray went through"},
    {"triangles", &RayStats::triangles_tested, {nullptr, nullptr}, "triangles that it was tested against"},
    {"lanes",
     &RayStats::lanes,
     {&RayStats::nodes_needed, &RayStats::leaves_needed},
     "lanes of the subgroup that needed the same visits, mean"},
    {"phase",
     &RayStats::packet_nodes,
     {&RayStats::nodes, nullptr},
     "share of its nodes on the path that the subgroup shares"},
};
/// Throws Error(Arguments) that lists the kinds there are.
const HeatKind& find_heat(std::string_view name);

/// The colours of the map, evenly spread over [0, top]; sRGB, to be blended as they are.
std::span<const glm::vec3, 5> heat_ramp();

/// The value that all but one in 200 stay below, at least 1; values may not be empty.
float heat_top_of(std::vector<float> values);

/// Adds the channels stats.* (float, means over the samples) of width * height pixels, row by row.
void add_stats(Image& image, std::span<const RayStats> sums, std::uint32_t spp);

/// Replaces R G B by the colour of one kind, dark blue to yellow over [0, top], alpha 1. Returns top: the subgroup's size
/// for lanes, 1 for phase, else the value that all but one in 200 pixels stay below, at least 1. `stats.*` must be there.
float paint_heat(Image& image, const HeatKind& kind, std::uint32_t subgroup);

}  // namespace ballot
