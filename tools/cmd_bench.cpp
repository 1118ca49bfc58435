#include <algorithm>

#include "tools/bench/compare.h"
#include "tools/bench/report.h"
#include "tools/bench/run.h"
#include "tools/cli.h"

namespace ballot::cli {

namespace {

namespace fs = std::filesystem;

struct Args {
  EngineArgs engine;
  std::vector<std::string> scenes;
  bench::PlanArgs plan;
  bench::RunOptions run;
  std::string size, report;
  std::vector<std::string> compare, measuring;  // measuring: names of options that --compare has no use for
  double tolerance = 0.02;
};

int compare_files(const Args& args) {
  if (!args.measuring.empty())
    fail(Failure::Arguments, "--compare reads two files and measures nothing; leave out {}",
         fmt::join(args.measuring, ", "));
  if (!(args.tolerance >= 0 && args.tolerance <= 10))
    fail(Failure::Arguments, "--tolerance: {} is not a share from 0 to 10, such as 0.02", args.tolerance);
  if (!args.engine.json.empty()) check_writable(args.engine.json);
  const auto a = bench::read_documents(args.compare[0]), b = bench::read_documents(args.compare[1]);
  const bench::Comparison comparison = bench::compare(a, b);
  const bool slower = bench::print_comparison(comparison, args.tolerance);
  write_json(args.engine.json, bench::comparison_json(comparison, args.tolerance));
  return slower ? 1 : 0;
}

bench::RunOptions checked_options(const Args& args) {
  bench::RunOptions options = args.run;
  options.engine = args.engine.options();
  options.command = command_line();
  if (options.repeats < 1 || options.repeats > 10000)
    fail(Failure::Arguments, "--repeat: {} is not between 1 and 10000", options.repeats);
  check_options(options.kinds);
  if (!args.size.empty()) {
    parse_size(args.size, options.width, options.height);
    check_options(RenderOptions{.width = options.width, .height = options.height});
  }
  return options;
}

/// Where the run is saved as it goes, so that a kill loses little.
void save(const Args& args, const bench::Document& document) {
  const nlohmann::json json = bench::to_json(document);
  write_json(args.engine.json, json);
  if (!args.report.empty()) write_json((fs::path(args.report) / "results.json").string(), json);
}

int finish_run(const Args& args, const bench::RunResult& result) {
  save(args, result.document);
  if (!args.report.empty()) {
    const std::string missing = bench::write_report(args.report, {result.document});
    if (!missing.empty()) fmt::print(stderr, "ballot: {}\n", missing);
    fmt::print("wrote {}\n", (fs::path(args.report) / "report.md").string());
  }
  if (result.failed) std::rethrow_exception(result.failed);
  if (result.document.partial) fmt::print(stderr, "ballot: interrupted; what was measured is kept\n");
  if (result.without > 0) fmt::print(stderr, "ballot: {} scenes x ray kinds have no rays (above)\n", result.without);
  if (result.wrong > 0) fmt::print(stderr, "ballot: {} hits are wrong or were not written\n", result.wrong);
  if (result.messages > 0) fmt::print(stderr, "ballot: {} validation messages (above)\n", result.messages);
  return result.document.partial || result.without > 0 || result.wrong > 0 || result.messages > 0 ? 1 : 0;
}

int run(const Args& args) {
  if (!args.compare.empty()) return compare_files(args);
  if (args.scenes.empty()) fail(Failure::Arguments, "bench: missing SCENE; 'ballot bench --help' lists what it takes");
  const bench::RunOptions options = checked_options(args);
  const bench::Plan plan = bench::make_plan(args.plan);
  if (args.plan.sweep && plan.sweeps.empty())
    fmt::print(stderr, "ballot: note: --sweep: none of the methods has a threshold to sweep\n");
  const auto devices = list_devices();
  const DeviceInfo& device = devices[choose_device(devices, args.engine.device)];
  for (const Query& query : plan.queries()) formulation_for(find_method(query.method), device, query.knobs);
  auto scenes = bench::load_scenes(args.scenes, plan);
  if (!args.engine.json.empty()) check_writable(args.engine.json);
  if (!args.report.empty()) bench::check_report_folder(args.report);
  const auto result =
      bench::run(plan, std::move(scenes), options, [&](const bench::Document& document) { save(args, document); });
  return finish_run(args, result);
}

std::string methods_text() {
  std::string text;
  for (const Method& m : kMethods) {
    std::string takes;
    for (const std::string& vote : bench::votes_of(m)) takes += (takes.empty() ? "vote=" : "|") + vote;
    if (m.threshold.unit != Threshold::None)
      takes += fmt::format("{}{}={:g}", takes.empty() ? "" : ", ", m.threshold.knob, m.threshold.standard);
    text += fmt::format("\n  {:<14} {}{}", m.name, m.summary, takes.empty() ? "" : " [" + takes + "]");
  }
  return text;
}

std::string kinds_text() {
  std::string text;
  for (const RayKind& kind : kRayKinds) text += fmt::format("\n  {:<14} {}", kind.name, kind.summary);
  return text + fmt::format("\n  {:<14} {}", "FILE.npy",
                            "rays as 'ballot trace' takes them; FILE.npy:any for any hit; NAME=FILE.npy: files of one "
                            "NAME are views of one set");
}

void add_options(CLI::App& cmd, Args& args) {
  std::string modes;
  for (const NumericMode& m : kNumericModes) modes += fmt::format("\n  {:<14} {}", m.name, m.summary);
  cmd.add_option("SCENE", args.scenes, "scene files");
  cmd.add_option("--methods", args.plan.methods,
                 "list of METHOD or METHOD:KNOB=VALUE:..., or 'all'; votes that are not given are all measured [all]" +
                     methods_text());
  cmd.add_option("--rays", args.plan.rays, "list of ray kinds and files, or 'all' [primary,secondary]" + kinds_text());
  cmd.add_option("--numeric", args.plan.numeric, fmt::format("list of arithmetics [{}]{}", kDefaultNumeric, modes));
  cmd.add_option("--knob", args.plan.knobs,
                 "NAME=VALUE for every method that it concerns, may be repeated" + knob_list())
      ->take_all();
  cmd.add_option("--views", args.plan.views, "list of cameras of the scenes, or 'all' [all]");
  cmd.add_option("--size", args.size, "WIDTHxHEIGHT [1024x1024 on a GPU, 256x256 on a CPU]");
  cmd.add_option("--repeat", args.run.repeats,
                 "interleaved repeats, 1 to 10000, each in another random order of a fixed seed [20]");
  cmd.add_option("--ao-rays", args.run.kinds.ao_rays, "rays of kind ao a hit, 1 to 64 [8]");
  cmd.add_option("--ao-radius", args.run.kinds.ao_radius, "their length, a share of the scene's diagonal [0.05]");
  cmd.add_flag("--sweep", args.plan.sweep, "search each threshold first and add METHOD(best)");
  cmd.add_flag("--counters", args.run.counters, "count node visits and the like, by kernels that are not timed");
  cmd.add_flag("--check", args.run.check, "hold every hit to the CPU oracle; exit code 1 if one is wrong");
  cmd.add_option("--report", args.report, "folder for report.md, results.json, records.csv and plots");
  cmd.add_option("--compare", args.compare,
                 "A.json B.json, instead of measuring: is B slower than A beyond noise? exit code 1 if so")
      ->expected(2);
  cmd.add_option("--tolerance", args.tolerance, "share by which B may be slower [0.02]");
  args.engine.add_options(cmd);
}

/// Options that were given and that only a run takes.
std::vector<std::string> measuring_options(const CLI::App& cmd) {
  std::vector<std::string> names;
  for (const CLI::Option* option : cmd.get_options()) {
    const std::string name = option->get_name();
    if (option->count() > 0 && name != "--compare" && name != "--tolerance" && name != "--json") names.push_back(name);
  }
  return names;
}

}  // namespace

void add_bench(CLI::App& app, int& result) {
  auto args = std::make_shared<Args>();
  CLI::App* cmd =
      app.add_subcommand("bench", "methods x ray kinds x arithmetics: speed, interleaved; or compare two runs");
  cmd->footer(
      "Example: ballot bench scenes/cornell.gltf --methods packet,if-if --rays primary,ao --sweep --check --report "
      "out/bench\n"
      "Ctrl-C ends it after the dispatch under way; what was measured is kept and marked as partial.");
  add_options(*cmd, *args);
  cmd->callback([args, cmd, &result] {
    args->measuring = measuring_options(*cmd);
    result = run(*args);
  });
}

}  // namespace ballot::cli
