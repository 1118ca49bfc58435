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
  std::string command;  // that the document names
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

/// Prints a table for each scene, ray kind and numeric mode. save(document) is called after each scene and ray kind; but
/// for the last one the document says that it is partial. SIGINT and SIGTERM end the run after the dispatch under way,
/// and the document then is partial, too. Throws what happens before anything is measured, and Error(Work) if nothing
/// could be.
RunResult run(const Plan& plan, std::vector<LoadedScene> scenes, RunOptions options,
              const std::function<void(const Document&)>& save);

}  // namespace ballot::bench
