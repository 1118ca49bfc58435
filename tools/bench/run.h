// Measures what a plan says, scene after scene.
#pragma once

#include <exception>
#include <functional>
#include <string>
#include <vector>

#include "tools/bench/plan.h"

namespace ballot::bench {

struct RunOptions {
  EngineOptions engine;
  std::uint32_t width = 0, height = 0;  // 0: 1024 x 1024 on a GPU, 256 x 256 on a CPU
  RayKindOptions kinds = {};
  std::uint32_t repeats = 20;
  bool counters = false, check = false;
  bool verify = false;    // hold every hit to the exact oracle
  std::size_t cases = 8;  // wrong answers that each record lists at most, where verified
  std::string command;    // that the document names
};

/// A loaded scene that waits for its turn.
struct LoadedScene {
  Scene scene;
  double load_s = 0;
};

/// Scenes of a run, all loaded before the first is measured. Throws Error(Arguments) if two have one name or a view of
/// the plan is missing, and as load_scene does.
std::vector<LoadedScene> load_scenes(const std::vector<std::string>& files, const Plan& plan);

struct RunResult {
  Document document;
  std::uint64_t wrong = 0;    // hits that check found wrong or unwritten
  std::size_t without = 0;    // scenes x ray kinds that no view has rays for
  std::size_t messages = 0;   // of the validation layers
  std::exception_ptr failed;  // Error that ended the run early; the document holds what was measured until then
};

/// What a run does as it goes, after every scene and ray kind.
struct RunHooks {
  std::function<void(const Document&)> print;  // gets the records of this scene and ray kind alone; no bar is drawn
  std::function<void(const Document&)> save;   // gets all records so far; but for the last time marked as partial
};

/// A table of speeds for each numeric mode.
void print_speeds(const Document& part);

/// What a document says of device and options, without scenes and records. options.width is not 0.
Document header(const DeviceInfo& device, const Plan& plan, const RunOptions& options);

/// The options with the size of a picture on this device, where none was given.
RunOptions with_size(RunOptions options, const DeviceInfo& device);

/// Measures all scenes. SIGINT and SIGTERM end the run after the dispatch under way,
/// and the document then is partial, too. Throws what happens before anything is measured, and Error(Work) if nothing
/// could be.
RunResult run(const Plan& plan, std::vector<LoadedScene> scenes, RunOptions options, const RunHooks& hooks);

}  // namespace ballot::bench
