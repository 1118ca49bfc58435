#include <optional>

#include "tools/bench/bench_queries.h"
#include "tools/program/help.h"
#include "tools/program/interrupt.h"
#include "tools/program/picture_size.h"
#include "tools/program/run_args.h"
#include "tools/verify/doubles.h"
#include "tools/verify/hard.h"
#include "tools/verify/origins.h"
#include "tools/verify/tables.h"

namespace ballot::cli {

namespace {

struct VerifyArgs {
  RunArgs run;
  bool methods_given = false, hard = false, quick = false, origins = false;
  std::string queries;
  std::optional<double> tolerance;  // most wrong answers per million rays; none: no limit
};

/// The results of a run: of its scenes, and the hard scenes that were not refused.
struct Found {
  bench::RunResult run;
  std::vector<std::string> not_refused;
  std::uint64_t unlike_in_double = 0;  // answers of mode double
};

/// Answers the hard cases of coordinates in double in the modes of a plan, and prints them.
void add_double_cases(const VerifyArgs& args, const bench::RunOptions& options, const bench::Plan& plan,
                      const std::shared_ptr<Context>& context, Found& found) {
  std::vector<std::string> modes;
  for (const bench::Entry& entry : plan.entries)
    if (std::ranges::find(modes, entry.query.numeric) == modes.end()) modes.push_back(entry.query.numeric);
  DeviceSceneOptions world = options.world;
  world.context = context;
  ProgressBar bar("hard cases in double");
  const InterruptGuard interrupt;
  const auto progress = [&](double share) { interrupt.stop("verify"), bar.update(share); };
  const std::vector<verify::DoubleRecord> records = verify::run_double_cases(modes, world, args.quick, progress);
  for (const verify::DoubleRecord& r : records) found.unlike_in_double += r.unlike;
  say("{}", verify::double_table(records));
}

/// Returns the default methods for scenes. They are few, because the exact answers take long.
std::string scene_methods() { return fmt::format("{},packet:vote=count", kDefaultMethod); }

/// Returns the default methods for hard cases: every method, with one vote each.
std::string hard_methods() {
  std::string text;
  for (const Method& m : kMethods)
    text += fmt::format("{}{}{}", text.empty() ? "" : ",", m.name, m.packet() ? ":vote=count" : "");
  return text;
}

bench::Plan hard_plan(const VerifyArgs& args) {
  RunArgs given = args.run;
  given.plan.rays = "primary";  // the cases bring their rays
  given.plan.views = "all";
  given.plan.sweep = false;
  if (!args.methods_given) given.plan.methods = hard_methods();
  return given.make_plan();
}

void check(const VerifyArgs& args) {
  if (args.origins && (args.hard || !args.run.scenes.empty()))
    fail(Failure::Arguments, "--origins is a study of its own scenes; leave out SCENE and --hard");
  if (args.run.scenes.empty() && !args.hard && !args.origins)
    fail(Failure::Arguments,
         "verify: nothing to verify; give SCENE, --hard, both, or --origins; 'ballot verify --help' lists the "
         "arguments");
  if (args.quick && !args.hard && !args.origins)
    fail(Failure::Arguments,
         "--quick shortens the hard cases or the study of origins, but neither was asked for; add --hard or "
         "--origins");
  if (args.tolerance && !(*args.tolerance >= 0 && *args.tolerance <= 1e6))
    fail(Failure::Arguments, "--tolerance: {} is not a number of wrong answers per million rays between 0 and 1000000",
         *args.tolerance);
}

void add_hard_cases(const VerifyArgs& args, const bench::RunOptions& options, const bench::Plan& plan, Found& found) {
  bench::Document& document = found.run.document;
  const auto begin = [&](const DeviceInfo& device) {
    if (document.device.empty()) document = bench::header(device, plan, with_size(options, device));
  };
  verify::HardResult hard = verify::run_hard_cases(plan.entries, {options.world, args.quick, options.cases}, begin);
  document.hard = std::move(hard.records);
  document.partial = document.partial || hard.signal != 0;
  if (hard.signal != 0) found.run.signal = hard.signal;
  found.run.messages += hard.messages;
  document.longest = hard.longest;
  found.not_refused = std::move(hard.not_refused);
  say("{}", verify::hard_table(document.hard));
  if (hard.signal == 0) add_double_cases(args, options, plan, hard.context, found);
}

Found measure(VerifyArgs& args) {
  RunArgs& given = args.run;
  bench::RunOptions options = given.options();
  options.verify = true;
  std::optional<bench::Plan> scene_plan, hard;
  if (!given.scenes.empty()) scene_plan = given.make_plan();
  if (args.hard) hard = hard_plan(args);
  given.note_files();
  auto scenes = scene_plan ? bench::load_scenes(given.scenes, *scene_plan, given.world.load_options(), true)
                           : std::vector<bench::LoadedScene>();
  Found found;
  const auto save = [&](const bench::Document& document) { given.save(document); };
  if (scene_plan) found.run = bench::run(*scene_plan, std::move(scenes), options, save);
  if (hard && !found.run.document.partial) add_hard_cases(args, options, *hard, found);
  return found;
}

/// Prints every failure to standard error. Returns true if there was one.
bool print_failures(const VerifyArgs& args, const Found& found) {
  std::map<std::string, std::uint64_t> broken;
  std::size_t above = 0;
  const auto judge = [&](const ErrorFigures& e) {
    above += args.tolerance && 1e6 * double(bench::wrong_of(e)) > *args.tolerance * double(e.rays);
  };
  for (const bench::Record& r : found.run.document.records)
    if (r.errors) {
      broken[r.numeric] += bench::broken_promises(*r.errors, r.numeric);
      judge(*r.errors);
    }
  for (const bench::HardRecord& r : found.run.document.hard) {
    if (!r.failed.empty()) say_aside("ballot: hard case {} failed: {}\n", r.name, r.failed);
    broken[r.failed.empty() ? r.numeric : "a hard case"] += verify::broken_promises(r);
    if (r.failed.empty()) judge(r.errors);
  }
  bool any = above > 0 || !found.not_refused.empty() || found.unlike_in_double > 0;
  if (found.unlike_in_double > 0)
    say_aside("ballot: double: {} answers of hard cases in double are not those of tests of every triangle\n",
              found.unlike_in_double);
  for (const auto& [numeric, count] : broken) {
    if (count > 0) say_aside("ballot: {}: {} answers break what the mode promises\n", numeric, count);
    any = any || count > 0;
  }
  if (above > 0)
    say_aside("ballot: {} records have more than {:g} wrong answers per million rays\n", above, *args.tolerance);
  for (const std::string& text : found.not_refused) say_aside("ballot: not refused: {}\n", text);
  return any;
}

int finish_run(const VerifyArgs& args, const Found& found) {
  const bench::RunResult& run = found.run;
  args.run.save(run.document);
  say("{}\n", verify::verdict(run.document));
  print_longest(run.document.longest);
  bench::say_end(run);
  const bool failures = print_failures(args, found);
  if (run.signal != 0) return 128 + run.signal;
  return failures || run.document.partial || run.without > 0 || run.messages > 0 ? 1 : 0;
}

void add_options(CLI::App& cmd, VerifyArgs& args) {
  args.run.plan.methods = scene_methods();
  args.run.plan.rays = "primary,secondary,ao,diffuse";
  args.run.plan.numeric = "all";
  args.run.add_options(cmd);
  cmd.add_flag("--hard", args.hard,
               "also run the hard cases: generated scenes and rays on which ray tracers are known to fail. SCENE may\n"
               "then be left out. Unless --methods is given, they run every method, with one vote each");
  cmd.add_flag("--origins", args.origins,
               "run another study instead: where secondary rays start. Counts self hits and lost contacts of every\n"
               "offset policy over generated scenes of 1e-6 to 1e6 scene units, up to 1e6 times their size away from\n"
               "the origin; takes minutes. It takes --size, --quick, --json and --device alone");
  cmd.add_option(
      "--queries", args.queries,
      "as that of bench, with each answer checked; with --hard also on the rays and points of the hard cases; " +
          queries_text());
  cmd.add_flag("--quick", args.quick,
               "run the hard cases with about a thousand rays each, the study of origins with few sizes and distances");
  cmd.add_option("--cases", args.run.run.cases,
                 "most wrong answers that each record lists, each with the exact reason [8]");
  cmd.add_option("--tolerance", args.tolerance,
                 "largest number of wrong answers per million rays that a record may have, 0 to 1000000; with more,\n"
                 "the exit code is 1 [no limit]");
}

void run_origins(VerifyArgs& args) {
  args.run.note_files();
  verify::OriginStudyArgs study{
      .world = args.run.world.options(), .json = args.run.world.json, .command = command_line(), .quick = args.quick};
  if (!args.run.size.empty()) parse_size(args.run.size, study.width, study.height);
  verify::run_origin_study(study);
}

}  // namespace

void add_verify(CLI::App& app, int& result) {
  auto args = std::make_shared<VerifyArgs>();
  CLI::App* cmd = app.add_subcommand(
      "verify", "measures speed and error: as bench, and checks every answer against an exact oracle");
  cmd->footer(
      "Example: ballot verify scenes/cornell.gltf --rays primary,rays.npy --repeat 5 --json verify.json\n"
      "Exit code 1 if a conservative mode gave an answer that its rounding error bound does not explain, if mode "
      "exact\n"
      "gave any wrong answer, or if a hit record was not written; in the hard cases also if a conservative mode leaks "
      "or\n"
      "its answers depend on the method. Other modes promise nothing: they are measured, and --tolerance can limit "
      "them.\n"
      "Ctrl-C ends the run after the current dispatch, or while the exact answers are computed; the results so far are "
      "kept.");
  add_options(*cmd, *args);
  show_first(*cmd, {"--methods", "--rays", "--numeric", "--size", "--repeat", "--hard", "--device", "--json"});
  cmd->callback([args, cmd, &result] {
    args->methods_given = cmd->count("--methods") > 0;
    check(*args);
    if (!args->queries.empty()) {
      args->run.note_files();
      result = bench_queries(args->run, args->queries, {.exact = true, .hard = args->hard, .quick = args->quick});
      return;
    }
    if (args->origins) return run_origins(*args);
    result = finish_run(*args, measure(*args));
  });
}

}  // namespace ballot::cli
