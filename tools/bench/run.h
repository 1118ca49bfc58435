// The run of a plan: measures scene after scene.
#pragma once

#include <exception>
#include <functional>
#include <string>
#include <vector>

#include "tools/bench/plan.h"

namespace ballot::bench {

struct RunOptions {
  DeviceSceneOptions world;
  std::uint32_t width = 0, height = 0;  // 0: 1024 x 1024 on a GPU, 256 x 256 on a CPU
  RayKindOptions kinds = {};
  std::uint32_t repeats = 20;
  bool counters = false, check = false;
  bool verify = false;    // check every hit against the exact oracle
  std::size_t cases = 8;  // most wrong answers that each verified record lists
  std::string command;    // the command line, for the document
};

/// A loaded scene that has not been measured yet.
struct LoadedScene {
  Scene scene;
  double load_s = 0;  // seconds that loading took
};

/// Loads all scenes of a run before the first one is measured. Throws Error(Arguments) if two scenes have the same name
/// or a view of the plan is missing, if an oracle `checks` answers of a scene with shapes, and as load_scene does.
std::vector<LoadedScene> load_scenes(const std::vector<std::string>& files, const Plan& plan,
                                     const LoadOptions& options, bool checks);

struct RunResult {
  Document document;
  std::uint64_t wrong = 0;    // hits that the check found wrong or unwritten
  std::size_t without = 0;    // pairs of scene and ray kind for which no view has rays
  std::size_t messages = 0;   // messages of the validation layers
  int signal = 0;             // the signal that ended the run early
  std::exception_ptr failed;  // the Error that ended the run early; the document holds the measurements so far
};

/// Called after every scene and ray kind with all records so far, marked as partial except the last time.
using SaveRun = std::function<void(const Document&)>;

/// Returns a document with device and options but without scenes and records. options.width must not be 0.
Document header(const DeviceInfo& device, const Plan& plan, const RunOptions& options);

/// Returns the options with the device's default picture size if none was given.
RunOptions with_size(RunOptions options, const DeviceInfo& device);

/// Says on standard error what was wrong with a run, and rethrows the Error that ended it early.
void say_end(const RunResult& result);

/// Measures all scenes, and prints a table of each scene and kind of rays. SIGINT, SIGTERM and SIGHUP end the run after
/// the current dispatch, and an Error ends it early; the document is then partial. Rethrows an Error that occurs before
/// anything is measured. Throws Error(Work) if no scene has rays of the chosen kinds.
RunResult run(const Plan& plan, std::vector<LoadedScene> scenes, RunOptions options, const SaveRun& save);

}  // namespace ballot::bench
