// Measures queries of points and of all crossings: speed, and errors by the exact oracles.
#pragma once

#include "tools/program/run_args.h"

namespace ballot::cli {

/// What is judged by the exact oracles.
struct QueryChecks {
  bool exact = false;  // each answer
  bool hard = false;   // also those of the hard cases (tools/hard/hard.h)
  bool quick = false;  // with about a thousand rays or points each
};

/// Measures the queries of a comma-separated list, or "all", on each scene. Prints a table a scene and writes the
/// figures with --json. Returns the exit code: 1 if an answer is beyond its bound, or wrong in mode exact. Throws
/// Error(Arguments) for a query or a mode that does not exist.
int bench_queries(const RunArgs& run, const std::string& queries, const QueryChecks& checks);

/// Returns the help of --queries.
std::string queries_text();

}  // namespace ballot::cli
