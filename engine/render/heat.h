// Heat maps: where in a picture a traversal method works, and how.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "engine/core/image.h"
#include "shaders/shared/variant.h"

namespace ballot {

/// What a heat map shows; all four are EXR channels stats.<name>.
struct HeatKind {
  std::string_view name;
  bool ratio;  // else a count, which grows with the samples
  float (*value)(const RayStats& sum_over_samples);
  std::string_view what;
};
inline constexpr HeatKind kHeatKinds[] = {
    {"nodes", false, [](const RayStats& s) { return float(s.nodes); }, "inner nodes that the ray went through"},
    {"triangles", false, [](const RayStats& s) { return float(s.triangles_tested); },
     "triangles that it was tested against"},
    {"lanes", true,
     [](const RayStats& s) {
       const std::uint32_t visits = s.nodes_needed + s.leaves_needed;
       return visits ? float(s.lanes) / float(visits) : 0.0f;
     },
     "lanes of the subgroup that needed the same visits, mean"},
    {"phase", true, [](const RayStats& s) { return s.nodes ? float(s.packet_nodes) / float(s.nodes) : 0.0f; },
     "share of its nodes on the path that the subgroup shares"},
};
/// Throws Error(Arguments) that lists the kinds there are.
const HeatKind& find_heat(std::string_view name);

/// Adds the channels stats.* (float, means over the samples) of width * height pixels, row by row.
void add_stats(Image& image, std::span<const RayStats> sums, std::uint32_t spp);

/// Replaces R G B by the colour of one kind, dark blue to yellow over [0, top], alpha 1. Returns top: the subgroup's size
/// for lanes, 1 for phase, else the value that all but one in 200 pixels stay below, at least 1. `stats.*` must be there.
float paint_heat(Image& image, const HeatKind& kind, std::uint32_t subgroup);

}  // namespace ballot
