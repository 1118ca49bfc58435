// Finds all crossings of the rays of a file.
#pragma once

#include <string>

#include "engine/ballot.h"

namespace ballot::cli {

/// What is wanted of the crossings of each ray.
enum class Crossings { Count, List };

/// What tracing a file gave.
struct CrossingTrace {
  std::uint64_t rays = 0, crossings = 0;
  TraceTimes times;
  DeadRays dead;
};

/// Finds the crossings of the rays of a file and writes them to `to`: their numbers, or at most the first `most` of
/// each ray. A file appears when it is complete. Throws Error.
CrossingTrace trace_crossings(Engine& engine, RayFile from, const std::string& to, Crossings want, std::uint32_t most,
                              const Progress& progress);

}  // namespace ballot::cli
