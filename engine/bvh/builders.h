// The registry of builders: how the BVH of a scene is made.
#pragma once

#include <cstdint>
#include <string_view>

#include "engine/core/registry.h"

namespace ballot {

enum class BuilderId : std::uint32_t { Best, Balanced, Fast, Device };

/// A row of the registry of builders. Every builder obeys BuildSettings::max_leaf and the two costs.
struct Builder {
  BuilderId id;
  std::string_view name;
  std::string_view summary;
  bool splits = false;     // makes spatial splits; the others ignore BuildSettings::split_budget
  bool on_device = false;  // runs on the Vulkan device (engine/tree/build/), not in build_bvh()
};

// clang-format off
inline constexpr Builder kBuilders[] = {
    {.id = BuilderId::Best, .name = "best",
     .summary = "surface area heuristic with spatial splits, by Embree (Stich, Friedrich and Dietrich 2009)",
     .splits = true},
    {.id = BuilderId::Balanced, .name = "balanced",
     .summary = "surface area heuristic over bins, without splits, by Embree (Wald 2007)"},
    {.id = BuilderId::Fast, .name = "fast",
     .summary = "Morton codes, by Embree (Lauterbach et al. 2009)"},
    {.id = BuilderId::Device, .name = "device",
     .summary = "clusters of neighbours in Morton order, on the Vulkan device (H-PLOC, Benthin et al. 2024)",
     .on_device = true},
};
// clang-format on

inline constexpr std::string_view kDefaultBuilder = "best";

constexpr const Builder& builder_of(BuilderId id) { return kBuilders[int(id)]; }

constexpr bool builders_are_in_order() {
  for (const Builder& b : kBuilders)
    if (&builder_of(b.id) != &b) return false;
  return true;
}
static_assert(builders_are_in_order(), "rows of kBuilders stand in the order of BuilderId");

/// Returns the builder with this name. Throws Error(Arguments) that lists the names there are.
inline const Builder& find_builder(std::string_view name) { return find_named(kBuilders, name, "BVH builder"); }

}  // namespace ballot
