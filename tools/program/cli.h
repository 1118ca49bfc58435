// The parts that all commands share: options, opening a scene, JSON output. Each command is one file cmd_*.cpp and is
// registered in program.cpp.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "engine/scene/device_scene.h"
#include "tools/program/command_files.h"
#include "tools/program/pieces.h"

namespace ballot::cli {

/// Returns the extensions of scene files, for help texts.
std::string scene_extensions();

/// The options of every command that opens a device and builds a BVH.
struct SceneArgs {
  std::string scene;
  std::string device;
  bool validate = false, no_cache = false, allow_outside = false;
  float split_budget = BuildSettings{}.split_budget;
  std::uint32_t max_leaf = BuildSettings{}.max_leaf;
  std::string build{kDefaultBuilder}, instances{kDefaultInstances}, shapes;
  float radius = 0;     // of points and lines
  std::string spacing;  // of heights
  std::string json;
  CommandFiles files;  // that the command reads and writes

  void add_to(CLI::App& app, bool scene_required);
  void add_options(CLI::App& app);        // all options except the scene
  void add_shape_options(CLI::App& app);  // of these
  DeviceSceneOptions options() const;
  LoadOptions load_options() const;  // throws Error(Arguments) for a wrong --instances, --shapes or --spacing
  /// Notes the scene as an input and --json as an output. Each command calls it before it prints or works: "--json -"
  /// claims standard output. Throws as CommandFiles does.
  void note_files();
};

/// Returns a line for each knob, for help texts.
std::string knob_list();

/// The options of every command that traces by one query: method, numeric mode, knobs.
struct QueryArgs {
  std::string method{kDefaultMethod}, numeric{kDefaultNumeric};
  std::vector<std::string> knobs;

  void add_to(CLI::App& app);
  Query query() const;  // throws Error(Arguments) for names and values that do not exist
};

/// An engine with its scene, and the time that loading took.
struct Opened {
  std::unique_ptr<DeviceScene> world;
  double load_s = 0;    // seconds to load the scene file
  double device_s = 0;  // seconds to wait for the device behind it
};
/// Loads the scene while the device is opened, and builds the BVH under a progress bar. `check` gets the scene before
/// that and may change its views and lights. Files that the scene consists of must not be outputs. Queries that
/// the device cannot run are refused before the BVH is built. `statistics` asks the driver for pipeline statistics.
/// Throws Error.
Opened open_scene(const SceneArgs& args, const std::vector<Query>& queries = {},
                  const std::function<void(Scene&)>& check = {}, bool statistics = false);

/// Returns the JSON object that a command fills with records: the keys device, driver, subgroup_size, commit, command,
/// and the scene's BVH figures under scenes.
nlohmann::json record_header(DeviceScene& world, double load_s);
void write_json(const std::string& path, const nlohmann::json& json);  // does nothing if path is empty
/// The same with the key longest_pass: the pass that took longest on the device so far.
void write_json(const std::string& path, DeviceScene& world, nlohmann::json json);
/// Prints which pass took longest on the device.
void print_longest(const Context::Timed& pass);

/// Adds --allow-outside for commands that load scenes.
void add_allow_outside(CLI::App& app, bool& allowed);
/// Adds --verbose, with which a command also prints kernels and where the time went.
void add_verbose(CLI::App& app, bool& verbose);
/// Adds --memory, which limits the process as soon as it is parsed.
void add_memory(CLI::App& app);

/// The command line of this process, quoted for a shell.
void set_command_line(int argc, char** argv);
const std::string& command_line();

/// Returns the exit code of a command that succeeded: 1 if --validate collected messages, else 0.
int finish(DeviceScene& world);

/// The end of a command whose work is done and whose files are written: ends the process with the code of finish() and
/// leaves memory and device to the system, which is faster than taking them apart. Returns that code instead, so that
/// all is destroyed, where somebody still needs it: a driver that may be writing its caches (Context::has_compiled),
/// layers and sanitizers, which report what is left.
int leave(DeviceScene& world);

/// Adds a command: `run` gets its arguments, which live as long as the app, and returns the exit code. Returns the
/// command, to which options are added, and the arguments.
template <class Args, class Run>
std::pair<CLI::App*, Args*> add_command(CLI::App& app, int& result, const char* name, Run run, const char* summary) {
  auto args = std::make_shared<Args>();
  CLI::App* cmd = app.add_subcommand(name, summary);
  cmd->callback([args, &result, run] { result = run(*args); });
  return {cmd, args.get()};
}

void add_info(CLI::App& app, int& result);
void add_render(CLI::App& app, int& result);
void add_merge(CLI::App& app, int& result);
void add_trace(CLI::App& app, int& result);
void add_distance(CLI::App& app, int& result);
void add_inside(CLI::App& app, int& result);
void add_check(CLI::App& app, int& result);
void add_view(CLI::App& app, int& result);
void add_bench(CLI::App& app, int& result);
void add_verify(CLI::App& app, int& result);
void add_selftest(CLI::App& app, int& result);
void add_methods(CLI::App& app, int& result);
void add_shaders(CLI::App& app, int& result);

/// Parses exactly N whole numbers that are separated by `comma`. Throws Error(Arguments).
template <std::size_t N>
std::array<std::uint32_t, N> numbers_of(const std::string& text, char comma, const char* option, const char* form) {
  std::array<std::uint32_t, N> numbers{};
  const char* at = text.c_str();
  for (std::size_t i = 0; i < N; ++i) {
    char* end = nullptr;
    const unsigned long value = std::isdigit(static_cast<unsigned char>(*at)) ? std::strtoul(at, &end, 10) : 0;
    if (!end || value > 0xFFFFFFFFul || *end != (i + 1 < N ? comma : '\0'))
      fail(Failure::Arguments, "{} {}: expected {}", option, text, form);
    numbers[i] = std::uint32_t(value);
    at = end + 1;
  }
  return numbers;
}

}  // namespace ballot::cli
