#include "tools/bench/bench_builders.h"
#include "tools/bench/bench_frames.h"
#include "tools/bench/bench_queries.h"
#include "tools/program/help.h"
#include "tools/program/run_args.h"

namespace ballot::cli {

namespace {

struct BenchArgs {
  RunArgs run;
  std::string builders, queries;
  BenchFrameArgs frames;
};

int finish_run(const RunArgs& args, const bench::RunResult& result) {
  args.save(result.document);
  print_longest(result.document.longest);
  bench::say_end(result);
  if (result.wrong > 0) say_aside("ballot: {} hits are wrong or were not written\n", result.wrong);
  if (result.signal != 0) return 128 + result.signal;
  return result.document.partial || result.without > 0 || result.wrong > 0 || result.messages > 0 ? 1 : 0;
}

int run_bench(BenchArgs& args) {
  RunArgs& given = args.run;
  if (given.scenes.empty()) fail(Failure::Arguments, "bench: missing SCENE; 'ballot bench --help' lists the arguments");
  if (!args.frames.frames.frames.empty()) return bench_frames(given, args.frames);
  args.frames.frames.check();
  if (!args.builders.empty()) {
    given.note_files();
    return bench_builders(given, args.builders);
  }
  if (!args.queries.empty()) {
    given.note_files();
    return bench_queries(given, args.queries, {.exact = given.run.check});
  }
  const bench::RunOptions options = given.options();
  const bench::Plan plan = given.make_plan();
  given.note_files();
  auto scenes = bench::load_scenes(given.scenes, plan, given.world.load_options(), given.run.check);
  given.world.files.check_read();
  const auto save = [&](const bench::Document& document) { given.save(document); };
  return finish_run(given, bench::run(plan, std::move(scenes), options, save));
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
}

}  // namespace

void add_bench(CLI::App& app, int& result) {
  auto args = std::make_shared<BenchArgs>();
  CLI::App* cmd = app.add_subcommand("bench", "measures the speed of traversal methods, ray kinds and numeric modes");
  cmd->footer(
      "Example: ballot bench scenes/cornell.gltf --methods packet,if-if --rays primary,ao --check --json bench.json\n"
      "tools/report makes tables, plots and comparisons of the JSON: python3 tools/report compare a.json b.json\n"
      "Ctrl-C ends the run after the current dispatch; the results so far are kept and marked as partial.");
  add_options(*cmd, *args);
  show_first(*cmd, {"--methods", "--rays", "--size", "--repeat", "--sweep", "--check", "--device", "--json"});
  cmd->callback([args, &result] { result = run_bench(*args); });
}

}  // namespace ballot::cli
