// Options of the commands that measure: bench and verify.
#pragma once

#include <vector>

#include "tools/bench/run.h"
#include "tools/cli.h"

namespace ballot::cli {

struct RunArgs {
  EngineArgs engine;
  std::vector<std::string> scenes;
  bench::PlanArgs plan;
  bench::RunOptions run;
  std::string size, report;

  /// Scenes, methods, rays, arithmetics, views, sizes, repeats, device; the defaults are what the members hold.
  void add_options(CLI::App& cmd);

  /// Throws Error(Arguments) for values out of range.
  bench::RunOptions options() const;

  /// Opens no device, but refuses what the chosen one could not do. Throws Error(Arguments) and as make_plan does.
  bench::Plan make_plan() const;
};

/// A line for each method with what it takes.
std::string methods_text();

}  // namespace ballot::cli
