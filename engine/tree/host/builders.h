// The registry of builders: how the BVH of a scene is made.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "engine/core/registry.h"

namespace ballot {

enum class BuilderId : std::uint32_t { Best, Balanced, Fast, Device, Auto };

/// A row of the registry of builders. Every builder obeys BuildSettings::max_leaf and the two costs.
struct Builder {
  BuilderId id;
  std::string_view name;
  std::string_view summary;
  bool splits = false;     // makes spatial splits; the others ignore BuildSettings::split_budget
  bool reinserts = false;  // subtrees of the finished tree move to where they cost less (reinsert.h)
  bool on_device = false;  // runs on the Vulkan device (engine/tree/device/), not in build_bvh()
  bool chooses = false;    // stands for one of the others: choose_builder()
};

// clang-format off
inline constexpr Builder kBuilders[] = {
    {.id = BuilderId::Best, .name = "best",
     .summary = "surface area heuristic with spatial splits, by Embree (Stich, Friedrich and Dietrich 2009); then "
                "subtrees are inserted anew where they cost less (Meister and Bittner 2018)",
     .splits = true, .reinserts = true},
    {.id = BuilderId::Balanced, .name = "balanced",
     .summary = "surface area heuristic over bins, without splits, by Embree (Wald 2007)"},
    {.id = BuilderId::Fast, .name = "fast",
     .summary = "Morton codes, by Embree (Lauterbach et al. 2009)"},
    {.id = BuilderId::Device, .name = "device",
     .summary = "clusters of neighbours in Morton order, on the Vulkan device (H-PLOC, Benthin et al. 2024)",
     .on_device = true},
    {.id = BuilderId::Auto, .name = "auto",
     .summary = "the one that is soonest done, building and tracing: `device` on a GPU, `balanced` or `fast` on a CPU",
     .chooses = true},
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

/// What builder `auto` chooses by.
struct BuildSite {
  bool on_cpu_device = true;  // a Vulkan device that runs on the CPU, or none
  bool takes_builder = true;  // builder `device` runs there
  std::size_t triangles = 0;
  std::optional<double> expected_rays = {};  // that will be traced in the tree, in all
};

/// On a CPU device, builder `balanced` is done sooner than `fast` from this many rays a triangle on
/// (tools/measured/building.md).
inline constexpr double kRaysForBalanced = 2;

/// Returns a builder that does not choose: `id` itself, or what `auto` stands for.
constexpr BuilderId choose_builder(BuilderId id, const BuildSite& site) {
  if (!builder_of(id).chooses) return id;
  if (!site.on_cpu_device && site.takes_builder) return BuilderId::Device;
  const bool few = site.expected_rays && *site.expected_rays < kRaysForBalanced * double(site.triangles);
  return few ? BuilderId::Fast : BuilderId::Balanced;
}

/// Returns the builder with this name. Throws Error(Arguments) that lists the names there are.
inline const Builder& find_builder(std::string_view name) { return find_named(kBuilders, name, "BVH builder"); }

}  // namespace ballot
