// The options of the commands that measure: bench and verify.
#pragma once

#include <vector>

#include "tools/bench/run.h"
#include "tools/program/cli.h"

namespace ballot::cli {

struct RunArgs {
  SceneArgs world;
  std::vector<std::string> scenes;
  bench::PlanArgs plan;
  bench::RunOptions run;
  std::string size;

  /// Adds the options for scenes, methods, rays, numeric modes, views, sizes, repeats and device. The members hold the
  /// defaults.
  void add_options(CLI::App& cmd);

  /// Notes the scenes as inputs and --json as an output. Throws as CommandFiles does.
  void note_files();

  /// Writes the run so far to --json; called after every block, so that a killed run loses little. A stream gets the
  /// whole run alone.
  void save(const bench::Document& document) const;

  /// Returns the checked options of the run. Throws Error(Arguments) for values out of range.
  bench::RunOptions options() const;

  /// Makes the plan of the run. It opens no device, but refuses queries that the chosen device cannot run. Throws
  /// Error(Arguments), and as bench::make_plan does.
  bench::Plan make_plan() const;
};

/// Returns the JSON of a run of this kind on the device, without records.
nlohmann::json device_header(const char* kind, const DeviceInfo& device);

/// Returns a line for each method with the votes and the threshold that it takes.
std::string methods_text();

}  // namespace ballot::cli
