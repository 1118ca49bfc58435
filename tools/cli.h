// What the commands share: options, progress, JSON. Commands are one file each, registered in ballot.cpp.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/ballot.h"

namespace ballot::cli {

/// Options of every command that opens a device and builds a BVH.
struct EngineArgs {
  std::string scene;
  std::string device;
  bool validate = false, no_cache = false;
  float split_budget = BuildSettings{}.split_budget;
  std::uint32_t max_leaf = BuildSettings{}.max_leaf;
  std::string json;

  void add_to(CLI::App& app, bool scene_required);
  void add_options(CLI::App& app);  // all but the scene
  EngineOptions options() const;
};

/// A line for each knob, for help texts.
std::string knob_list();

/// Options of every command that traces.
struct QueryArgs {
  std::string method{kDefaultMethod}, numeric{kDefaultNumeric};
  std::vector<std::string> knobs;

  void add_to(CLI::App& app);
  Query query() const;  // throws Error(Arguments)
};

/// A scene and an engine with a progress bar, and the seconds that each step took.
struct Opened {
  std::unique_ptr<Engine> engine;
  double load_s = 0;
};
/// check sees the scene before device and BVH are touched, and may change its views; queries are refused before the BVH is built.
Opened open_scene(const EngineArgs& args, const std::vector<Query>& queries = {},
                  const std::function<void(Scene&)>& check = {}, bool statistics = false);

/// "512x512" to width and height. Throws Error(Arguments).
void parse_size(const std::string& text, std::uint32_t& width, std::uint32_t& height);

/// device, driver, subgroup_size, commit, command, and the scene's BVH figures under scenes.
nlohmann::json record_header(Engine& engine, double load_s);
void write_json(const std::string& path, const nlohmann::json& json);  // nothing if path is empty

/// The command line of this process, quoted for a shell.
void set_command_line(int argc, char** argv);
const std::string& command_line();

/// Exit code 1 if --validate collected messages.
int finish(Engine& engine);

void add_info(CLI::App& app, int& result);
void add_render(CLI::App& app, int& result);
void add_merge(CLI::App& app, int& result);
void add_trace(CLI::App& app, int& result);
void add_view(CLI::App& app, int& result);
void add_bench(CLI::App& app, int& result);
void add_verify(CLI::App& app, int& result);
void add_report(CLI::App& app, int& result);
void add_shaders(CLI::App& app, int& result);

}  // namespace ballot::cli
