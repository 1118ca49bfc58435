#include <algorithm>

#include "tools/bench/compare.h"
#include "tools/bench/report.h"
#include "tools/bench_builders.h"
#include "tools/bench_frames.h"
#include "tools/bench_queries.h"
#include "tools/help.h"
#include "tools/run_args.h"

namespace ballot::cli {

namespace {

namespace fs = std::filesystem;

struct BenchArgs {
  RunArgs run;
  std::vector<std::string> compare, measuring;  // measuring: the given options that --compare does not take
  double tolerance = 0.02;
  std::string builders, queries;
  BenchFrameArgs frames;
};

int compare_files(BenchArgs& args) {
  if (args.compare.size() != 2)
    fail(Failure::Arguments, "--compare {}: needs two files, the older run's and the newer one's", args.compare[0]);
  if (!args.measuring.empty())
    fail(Failure::Arguments, "--compare reads two files and measures nothing; leave out {}",
         fmt::join(args.measuring, ", "));
  if (!(args.tolerance >= 0 && args.tolerance <= 10))
    fail(Failure::Arguments, "--tolerance: {} is not a share from 0 to 10, such as 0.02", args.tolerance);
  EngineArgs& engine = args.run.engine;
  for (const std::string& file : args.compare) engine.files.reads("--compare", file);
  engine.note_files();
  const auto a = bench::read_documents(args.compare[0]), b = bench::read_documents(args.compare[1]);
  const bench::Comparison comparison = bench::compare(a, b);
  const bool slower = bench::print_comparison(comparison, args.tolerance);
  write_json(engine.json, bench::comparison_json(comparison, args.tolerance));
  return slower ? 1 : 0;
}

/// Saves the run so far to its files; called after every block, so that a killed run loses little.
void save(const RunArgs& args, const bench::Document& document) {
  const nlohmann::json json = bench::to_json(document);
  if (!document.partial || !descriptor_of(args.engine.json)) write_json(args.engine.json, json);  // a stream: once
  if (!args.report.empty()) write_json((fs::path(args.report) / "results.json").string(), json);
}

int finish_run(const RunArgs& args, const bench::RunResult& result) {
  save(args, result.document);
  print_longest(result.document.longest);
  if (!args.report.empty()) {
    const std::string missing = bench::write_report(args.report, {result.document});
    if (!missing.empty()) say_aside("ballot: {}\n", missing);
    say("wrote {}\n", (fs::path(args.report) / "report.md").string());
  }
  if (result.failed) std::rethrow_exception(result.failed);
  if (result.signal != 0) say_aside("ballot: interrupted; what was measured is kept\n");
  if (result.without > 0) say_aside("ballot: {} pairs of scene and ray kind have no rays (above)\n", result.without);
  if (result.wrong > 0) say_aside("ballot: {} hits are wrong or were not written\n", result.wrong);
  if (result.messages > 0) say_aside("ballot: {} validation messages (above)\n", result.messages);
  if (result.signal != 0) return 128 + result.signal;
  return result.document.partial || result.without > 0 || result.wrong > 0 || result.messages > 0 ? 1 : 0;
}

int run_bench(BenchArgs& args) {
  if (!args.compare.empty()) return compare_files(args);
  RunArgs& given = args.run;
  if (given.scenes.empty()) fail(Failure::Arguments, "bench: missing SCENE; 'ballot bench --help' lists the arguments");
  if (!args.frames.frames.frames.empty()) return bench_frames(given, args.frames);
  args.frames.frames.check();
  if (!args.builders.empty()) {
    given.note_files({});
    return bench_builders(given, args.builders);
  }
  if (!args.queries.empty()) {
    given.note_files({});
    return bench_queries(given, args.queries, {.exact = given.run.check});
  }
  const bench::RunOptions options = given.options();
  const bench::Plan plan = given.make_plan();
  given.note_files(bench::kReportFiles);
  auto scenes = bench::load_scenes(given.scenes, plan, given.engine.load_options());
  given.engine.files.check_read();
  const bench::RunHooks hooks{bench::print_speeds, [&](const bench::Document& document) { save(given, document); }};
  return finish_run(given, bench::run(plan, std::move(scenes), options, hooks));
}

void add_options(CLI::App& cmd, BenchArgs& args) {
  args.run.add_options(cmd);
  args.frames.add_to(cmd);
  cmd.add_option("--builders", args.builders, builders_text());
  cmd.add_option("--queries", args.queries, queries_text());
  cmd.add_flag("--counters", args.run.run.counters,
               "also count node visits, active lanes and the like, in extra dispatches that are not timed");
  cmd.add_flag("--check", args.run.run.check,
               "also check every hit against the CPU oracle; exit code 1 if one is wrong");
  cmd.add_option("--report", args.run.report,
                 "folder for report.md, results.json, records.csv and plots; e.g. --report out/bench");
  cmd.add_option("--compare", args.compare,
                 "A.json B.json: measures nothing, but tells if B is slower than A beyond noise; exit code 1 if so.\n"
                 "The files are those of --json or results.json of a report")
      ->expected(1, 2);
  cmd.add_option("--tolerance", args.tolerance,
                 "for --compare: share by which B may be slower, 0 to 10 [0.02]; 0.02 is 2 %");
}

/// Returns the names of the given options that only a measuring run takes.
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
  CLI::App* cmd = app.add_subcommand(
      "bench", "measures the speed of traversal methods, ray kinds and numeric modes; or compares two runs");
  cmd->footer(
      "Example: ballot bench scenes/cornell.gltf --methods packet,if-if --rays primary,ao --sweep --check --report "
      "out/bench\n"
      "Ctrl-C ends the run after the current dispatch; the results so far are kept and marked as partial.");
  add_options(*cmd, *args);
  show_first(*cmd, {"--methods", "--rays", "--size", "--repeat", "--sweep", "--check", "--report", "--compare",
                    "--device", "--json"});
  cmd->callback([args, cmd, &result] {
    args->measuring = measuring_options(*cmd);
    result = run_bench(*args);
  });
}

}  // namespace ballot::cli
