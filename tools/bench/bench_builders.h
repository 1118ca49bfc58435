// Measures the builders of trees: time, memory, cost, and how fast their trees are traced.
#pragma once

#include "tools/program/run_args.h"

namespace ballot::cli {

/// Measures each builder of a comma-separated list, or "all", on each scene. Prints a table a scene and writes the
/// figures with --json. Returns the exit code. Throws Error(Arguments) for a builder that does not exist.
int bench_builders(const RunArgs& run, const std::string& builders);

/// Returns the help of --builders.
std::string builders_text();

}  // namespace ballot::cli
