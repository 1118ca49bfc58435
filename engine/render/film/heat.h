// Heat maps: the work of the traversal at each pixel of a picture, shown as colours.
#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <span>
#include <string_view>
#include <vector>

#include "engine/files/image.h"
#include "shaders/shared/variant.h"

namespace ballot {

/// The quantity that a heat map shows: a counter, or a counter divided by the sum of others. Each quantity is written
/// as the EXR channel stats.<name>.
struct HeatKind {
  using Field = std::uint32_t RayStats::*;
  std::string_view name;
  Field count;
  Field over[2];  // the counters that `count` is divided by; null: none. Without any, the value grows with the samples
  std::string_view what;

  bool ratio() const { return over[0] != nullptr; }
  /// Returns the quantity for counters summed over the samples of a pixel; 0 / 0 is 0.
  float value(const RayStats& sum_over_samples) const;
  /// Returns the value that the last colour stands for, if it does not depend on the picture: the subgroup size for
  /// "lanes", 1 for other ratios. Returns 0 for counts.
  float fixed_top(std::uint32_t subgroup) const;
};
inline constexpr HeatKind kHeatKinds[] = {
    {"nodes", &RayStats::nodes, {nullptr, nullptr}, "inner nodes that the ray visited"},
    {"triangles", &RayStats::triangles_tested, {nullptr, nullptr}, "triangles that the ray was tested against"},
    {"lanes",
     &RayStats::lanes,
     {&RayStats::nodes_needed, &RayStats::leaves_needed},
     "mean number of lanes of the subgroup that needed the same visit"},
    {"phase",
     &RayStats::packet_nodes,
     {&RayStats::nodes, nullptr},
     "share of the ray's nodes that lie on the path shared by the subgroup"},
};
/// Returns the heat map quantity of this name. Throws Error(Arguments) that lists the known names.
const HeatKind& find_heat(std::string_view name);

/// Returns the colours of the map, evenly spaced over [0, top]. They are sRGB values and are interpolated in sRGB.
std::span<const glm::vec3, 5> heat_ramp();

/// Returns the 99.5th percentile of the values, at least 1. `values` must not be empty.
float heat_top_of(std::vector<float> values);

/// Adds the channels stats.* (float). `sums` has width * height records, row by row; counts are divided by `spp`.
void add_stats(Image& image, std::span<const RayStats> sums, std::uint32_t spp);

/// Replaces R G B by the colours of one heat map, dark blue to yellow over [0, top], and A by 1. Throws
/// Error(Arguments) if R, G, B, A or the channel stats.<name> is missing.
void paint_heat(Image& image, const HeatKind& kind, float top);
/// The same with the usual top, which it returns: the subgroup size for "lanes", 1 for "phase", else the 99.5th
/// percentile over the pixels, at least 1.
float paint_heat_of(Image& image, const HeatKind& kind, std::uint32_t subgroup);

}  // namespace ballot
