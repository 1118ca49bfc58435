// What `ballot render --verbose` prints, and what its JSON tells of times.
#pragma once

#include "tools/program/cli.h"

namespace ballot::cli {

/// The wall time of a view by where it went, in seconds. The host's part is the remainder: recording, waiting,
/// compiling.
struct Wall {
  double device_s, film_s, write_s, wall_s;
  double host_s() const { return std::max(0.0, wall_s - device_s - film_s - write_s); }
};

nlohmann::json passes_json(const RenderTimes& times);
nlohmann::json wall_json(const Wall& wall);
void print_times(const RenderTimes& times, const Wall& wall, bool png);

/// Prints the kernel that traced the primary rays, and what auto chose.
void print_kernel(DeviceScene& world, const Query& query);

}  // namespace ballot::cli
