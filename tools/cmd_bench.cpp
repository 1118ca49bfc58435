#include <algorithm>

#include "tools/bench/compare.h"
#include "tools/bench/report.h"
#include "tools/run_args.h"

namespace ballot::cli {

namespace {

namespace fs = std::filesystem;

struct BenchArgs {
  RunArgs run;
  std::vector<std::string> compare, measuring;  // measuring: names of options that --compare has no use for
  double tolerance = 0.02;
};

int compare_files(const BenchArgs& args) {
  if (!args.measuring.empty())
    fail(Failure::Arguments, "--compare reads two files and measures nothing; leave out {}",
         fmt::join(args.measuring, ", "));
  if (!(args.tolerance >= 0 && args.tolerance <= 10))
    fail(Failure::Arguments, "--tolerance: {} is not a share from 0 to 10, such as 0.02", args.tolerance);
  const std::string& json = args.run.engine.json;
  if (!json.empty()) check_writable(json);
  const auto a = bench::read_documents(args.compare[0]), b = bench::read_documents(args.compare[1]);
  const bench::Comparison comparison = bench::compare(a, b);
  const bool slower = bench::print_comparison(comparison, args.tolerance);
  write_json(json, bench::comparison_json(comparison, args.tolerance));
  return slower ? 1 : 0;
}

/// Where the run is saved as it goes, so that a kill loses little.
void save(const RunArgs& args, const bench::Document& document) {
  const nlohmann::json json = bench::to_json(document);
  write_json(args.engine.json, json);
  if (!args.report.empty()) write_json((fs::path(args.report) / "results.json").string(), json);
}

int finish_run(const RunArgs& args, const bench::RunResult& result) {
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

int run_bench(const BenchArgs& args) {
  if (!args.compare.empty()) return compare_files(args);
  const RunArgs& given = args.run;
  if (given.scenes.empty()) fail(Failure::Arguments, "bench: missing SCENE; 'ballot bench --help' lists what it takes");
  const bench::RunOptions options = given.options();
  const bench::Plan plan = given.make_plan();
  auto scenes = bench::load_scenes(given.scenes, plan);
  if (!given.engine.json.empty()) check_writable(given.engine.json);
  if (!given.report.empty()) bench::check_report_folder(given.report);
  const bench::RunHooks hooks{bench::print_speeds, [&](const bench::Document& document) { save(given, document); }};
  return finish_run(given, bench::run(plan, std::move(scenes), options, hooks));
}

void add_options(CLI::App& cmd, BenchArgs& args) {
  args.run.add_options(cmd);
  cmd.add_flag("--counters", args.run.run.counters, "count node visits and the like, by kernels that are not timed");
  cmd.add_flag("--check", args.run.run.check, "hold every hit to the CPU oracle; exit code 1 if one is wrong");
  cmd.add_option("--report", args.run.report, "folder for report.md, results.json, records.csv and plots");
  cmd.add_option("--compare", args.compare,
                 "A.json B.json, instead of measuring: is B slower than A beyond noise? exit code 1 if so")
      ->expected(2);
  cmd.add_option("--tolerance", args.tolerance, "share by which B may be slower [0.02]");
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
  auto args = std::make_shared<BenchArgs>();
  CLI::App* cmd =
      app.add_subcommand("bench", "methods x ray kinds x arithmetics: speed, interleaved; or compare two runs");
  cmd->footer(
      "Example: ballot bench scenes/cornell.gltf --methods packet,if-if --rays primary,ao --sweep --check --report "
      "out/bench\n"
      "Ctrl-C ends it after the dispatch under way; what was measured is kept and marked as partial.");
  add_options(*cmd, *args);
  cmd->callback([args, cmd, &result] {
    args->measuring = measuring_options(*cmd);
    result = run_bench(*args);
  });
}

}  // namespace ballot::cli
