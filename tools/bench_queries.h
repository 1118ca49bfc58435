// Measures queries of points and of all crossings: speed, and errors by the exact oracles.
#pragma once

#include "tools/run_args.h"

namespace ballot::cli {

/// Measures the queries of a comma-separated list, or "all", on each scene. `check`: also judges each answer. Prints a
/// table a scene and writes the figures with --json. Returns the exit code: 1 if an answer is beyond its bound, or
/// wrong in mode exact. Throws Error(Arguments) for a query or a mode that does not exist.
int bench_queries(const RunArgs& run, const std::string& queries, bool check);

/// Returns the help of --queries.
std::string queries_text();

}  // namespace ballot::cli
