#include "tools/program/cli.h"

#include <chrono>
#include <cstdlib>
#include <future>

#include "tools/bench/document.h"
#include "tools/program/shell_word.h"

namespace ballot::cli {

namespace {
std::string command;
}

std::string scene_extensions() {
  std::string extensions;
  for (const SceneFormat& f : scene_formats())
    extensions += fmt::format("{}{}", extensions.empty() ? "" : ", ", f.extension);
  return extensions;
}

void SceneArgs::add_to(CLI::App& app, bool scene_required) {
  auto* option = app.add_option("SCENE", scene, "scene file, one of: " + scene_extensions());
  if (scene_required) option->required();
  add_options(app);
}

void SceneArgs::add_options(CLI::App& app) {
  app.add_option("--device", device,
                 "Vulkan device: its index in the list of 'ballot info', a part of its name, 'gpu' or 'cpu'\n"
                 "[the best GPU, else a CPU]; e.g. --device llvmpipe");
  app.add_flag("--validate", validate,
               "turn on Vulkan's validation layers with synchronization checks; exit code 1 if they report anything");
  std::string builders;
  for (const Builder& b : kBuilders) builders += fmt::format("\n  {:<12} {}", b.name, b.summary);
  app.add_option("--build", build, fmt::format("BVH builder [{}]{}", kDefaultBuilder, builders));
  std::string policies;
  for (const InstancePolicyInfo& i : kInstancePolicies) policies += fmt::format("\n  {:<12} {}", i.name, i.summary);
  app.add_option("--instances", instances,
                 fmt::format("meshes that a glTF file uses several times [{}]{}", kDefaultInstances, policies));
  add_shape_options(app);
  app.add_option(
      "--split-budget", split_budget,
      "BVH build 'best': extra triangle references that spatial splits may add, as a share of the triangles,\n"
      "0 to 16 [0.5]; e.g. 0.5 allows 50 % more references");
  app.add_option("--max-leaf", max_leaf, "BVH build: largest number of triangles in a leaf, 1 to 6 [6]");
  app.add_flag("--no-cache", no_cache, "build the BVH again; neither read nor write the BVH cache");
  app.add_option("--json", json, "also write the results to this JSON file; '-': standard output, and text elsewhere");
  add_allow_outside(app, allow_outside);
  add_memory(app);
}

void SceneArgs::add_shape_options(CLI::App& app) {
  std::string kinds;
  for (const ShapeInfo& s : kShapes)
    if (&s != &kShapes[0]) kinds += fmt::format("\n  {:<12} {}", s.name, s.summary);
  app.add_option(
      "--shapes", shapes,
      fmt::format("what points of PLY and rows of .npy are, where the file does not tell or has faces{}", kinds));
  app.add_option("--radius", radius,
                 "radius of points and lines of PLY, .npy and glTF that have none, in the units of the scene");
  app.add_option("--spacing", spacing,
                 "of heights: from a sample to the next along x, and along y if it differs [1]; e.g. 0.5,0.25");
}

void SceneArgs::note_files() {
  files.reads("SCENE", scene);
  json = files.writes("--json", json).string();
}

void add_allow_outside(CLI::App& app, bool& allowed) {
  app.add_flag("--allow-outside", allowed,
               "let the scene read buffers, images and materials that are not in its folder or below it");
}

void add_verbose(CLI::App& app, bool& verbose) {
  app.add_flag("-v,--verbose", verbose, "also print the kernels, what auto chose, and where the time went");
}

void add_memory(CLI::App& app) {
  app.add_option_function<std::string>(
      "--memory", [](const std::string& text) { set_memory_limit(parse_bytes(text, "--memory")); },
      "most memory of the host that the command may take, such as 512M or 4G; what would take more is refused before\n"
      "it is loaded [what the machine has]");
}

DeviceSceneOptions SceneArgs::options() const {
  DeviceSceneOptions o;
  o.device = device;
  o.validate = validate;
  o.use_cache = !no_cache;
  o.build.split_budget = split_budget;
  o.build.max_leaf = max_leaf;
  o.build.builder = find_builder(build).id;
  return o;
}

namespace {

/// Returns the numbers of X or X,Y, which are above 0. Throws Error(Arguments).
glm::dvec2 parse_spacing(const std::string& text) {
  char* end = nullptr;
  glm::dvec2 spacing(std::strtod(text.c_str(), &end));
  if (*end == ',') spacing.y = std::strtod(end + 1, &end);
  const bool right = *end == 0 && spacing.x > 0 && spacing.y > 0 && std::isfinite(spacing.x + spacing.y);
  if (!right) fail(Failure::Arguments, "--spacing {}: expected X or X,Y: finite numbers above 0", text);
  return spacing;
}

}  // namespace

LoadOptions SceneArgs::load_options() const {
  LoadOptions options{.allow_outside = allow_outside,
                      .instances = find_named(kInstancePolicies, instances, "policy of --instances").id,
                      .radius = radius};
  if (!spacing.empty()) options.spacing = parse_spacing(spacing);
  if (!shapes.empty()) options.shapes = &find_named(kShapes, shapes, "kind of --shapes");
  return options;
}

std::string knob_list() {
  std::string text;
  for (const KnobInfo& k : ballot::knobs()) text += fmt::format("\n  {:<14} {}: {}", k.name, k.values, k.what);
  return text;
}

void QueryArgs::add_to(CLI::App& app) {
  std::string methods, modes;
  for (const Method& m : kMethods) methods += fmt::format("\n  {:<12} {}", m.name, m.summary);
  for (const NumericMode& m : kNumericModes) modes += fmt::format("\n  {:<12} {}", m.name, m.summary);
  app.add_option("--method", method, fmt::format("traversal method [{}]{}", kDefaultMethod, methods));
  app.add_option("--numeric", numeric,
                 fmt::format("numeric mode: the arithmetic of the intersection tests [{}]{}", kDefaultNumeric, modes));
  app.add_option("--knob", knobs,
                 "NAME=VALUE: sets a tuning parameter of the kernels; may be repeated. Knobs that are not given take\n"
                 "the device's values of the tuning table; e.g. --knob vote=count --knob workgroup=128" +
                     knob_list())
      ->take_all();
}

Query QueryArgs::query() const {
  Query q;
  q.method = find_method(method).name;
  q.numeric = find_numeric(numeric).name;
  for (const std::string& text : knobs) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos)
      fail(Failure::Arguments, "--knob: '{}' is not of the form NAME=VALUE, such as vote=count", text);
    q.knobs[text.substr(0, equals)] = text.substr(equals + 1);
  }
  KernelConfig scratch;
  apply_knobs(scratch, q.knobs);
  return q;
}

Opened open_scene(const SceneArgs& args, const std::vector<Query>& queries, const std::function<void(Scene&)>& check,
                  bool statistics) {
  const auto start = std::chrono::steady_clock::now();
  DeviceSceneOptions options = args.options();
  options.statistics = statistics;
  prepare_driver_cache();  // sets variables of the environment, so before there are threads
  // Opening a device takes a GPU's driver 0.1 s, so it begins while the scene is loaded.
  std::future<std::shared_ptr<Context>> device =
      std::async(std::launch::async, [&] { return DeviceScene::open_device(options); });
  Scene scene = load_scene(args.scene, args.load_options());
  args.files.check_read();
  Opened opened;
  opened.load_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  for (const std::string& note : scene.notes) say_aside("ballot: {}: {}\n", args.scene, note);
  if (check) check(scene);
  options.queries = queries;
  const auto loaded = std::chrono::steady_clock::now();
  options.context = device.get();
  opened.device_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - loaded).count();
  ProgressBar bar("building BVH");
  opened.world = std::make_unique<DeviceScene>(std::move(scene), options, [&](double done) { bar.update(done); });
  return opened;
}

nlohmann::json record_header(DeviceScene& world, double load_s) {
  const nlohmann::json scene = bench::scene_json({world.scene().name, world.bvh_stats(), load_s});
  return {{"device", world.device().name},
          {"driver", world.device().driver},
          {"subgroup_size", world.device().subgroup_size},
          {"commit", commit()},
          {"command", command_line()},
          {"scenes", nlohmann::json::array({scene})},
          {"records", nlohmann::json::array()}};
}

void write_json(const std::string& path, const nlohmann::json& json) {
  if (!path.empty()) write_file(path, json_text(json));
}

void write_json(const std::string& path, DeviceScene& world, nlohmann::json json) {
  json["longest_pass"] = bench::longest_json(world.context()->longest_pass());
  write_json(path, json);
}

void print_longest(const Context::Timed& pass) {
  say("  longest pass on the device: {:.3f} ms, {}\n", pass.ms, pass.what);
}

void set_command_line(int argc, char** argv) {
  command.clear();
  for (int i = 0; i < argc; ++i) command += (i ? " " : "") + shell_word(argv[i]);
}

const std::string& command_line() { return command; }

int finish(DeviceScene& world) {
  if (world.messages().empty()) return 0;
  say_aside("ballot: {} validation messages (above)\n", world.messages().size());
  return 1;
}

int leave(DeviceScene& world) {
  const int code = finish(world);
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  constexpr bool kSanitized = true;  // sanitizers report at the end of main()
#else
  constexpr bool kSanitized = false;
#endif
  const Context& gpu = *world.context();
  const bool layers = gpu.validating() || std::getenv("VK_INSTANCE_LAYERS") != nullptr;
  if (kSanitized || layers || gpu.has_compiled()) return code;
  flush_text();
  std::_Exit(code);
}

}  // namespace ballot::cli
