// Finds all crossings of the rays of a file.
#pragma once

#include <string>

#include "engine/scene/device_scene.h"

namespace ballot::cli {

/// What is wanted of the crossings of each ray.
struct CrossingsWanted {
  enum { Counts, Lists, Hits } as = Counts;  // hits: the first crossing of each ray, or a miss
  CrossingQuery query = {};
  std::uint32_t last = 0;  // of lists: so many of each ray, the farthest first; 0: as the query says, the nearest first
  std::span<const std::uint32_t> ray_masks = {};  // of each ray; none: all bits
};

/// What tracing a file gave.
struct CrossingTrace {
  std::uint64_t rays = 0, crossings = 0;
  TraceTimes times;
  DeadRays dead;
};

/// Finds the crossings of the rays of a file and writes them to `to`. A file appears when it is complete. Throws Error.
CrossingTrace trace_crossings(DeviceScene& world, RayFile from, const std::string& to, const CrossingsWanted& want,
                              const Progress& progress);

}  // namespace ballot::cli
