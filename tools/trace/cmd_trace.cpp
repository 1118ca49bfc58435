#include <algorithm>

#include "tools/program/cli.h"
#include "tools/program/help.h"
#include "tools/program/interrupt.h"
#include "tools/program/option_rows.h"
#include "tools/trace/crossings.h"
#include "tools/trace/files.h"

namespace ballot::cli {

namespace {

struct TraceArgs {
  SceneArgs world;
  QueryArgs query;
  std::vector<std::string> rays, out, ray_masks;
  std::string part, masks;
  OptionRows rows;  // any, first, cull, alpha
  bool count = false, all = false, t_double = false, verbose = false;

  /// Returns what is asked of crossings.
  CrossingQuery crossing() const {
    BallotQuery asked = rows.query();
    asked.numeric = query.numeric;
    return api::crossing_query(asked);
  }
  /// Returns true if crossings are asked for: counts, lists, or of each ray the first as its hit.
  bool crossings() const {
    return count || all || !masks.empty() || !ray_masks.empty() || api::asks_for_crossings(rows.query());
  }
};

/// Opens a file of rays, or the part of it that --part names.
RayFile open_rays(const TraceArgs& args, const std::string& name) {
  RayFile file(name);
  if (args.part.empty()) return file;
  const auto part = numbers_of<2>(args.part, '/', "--part", "I/N: part I of N parts, I from 0 to N - 1");
  if (part[1] == 0 || part[0] >= part[1])
    fail(Failure::Arguments, "--part {}: expected I/N with I from 0 to N - 1", args.part);
  file.choose_part(part[0], part[1]);
  return file;
}

/// Says how many rays could not be traced, and why.
void warn_of_dead(const std::string& file, std::uint64_t rays, const DeadRays& dead) {
  const auto warn = [&](std::uint64_t count, const char* reason) {
    if (count > 0) say_aside("ballot: {}: {} of {} rays {}; they are misses\n", file, count, rays, reason);
  };
  warn(dead.not_finite, "have a component that is NaN or infinite");
  warn(dead.no_direction, "have no direction: each component is zero or denormal");
}

/// Checks the lists of files before work begins.
void check_files(TraceArgs& args) {
  if (args.rays.size() != args.out.size())
    fail(Failure::Arguments, "--rays names {} files and --out {}; expected as many", args.rays.size(), args.out.size());
  if (std::ranges::count(args.rays, "-") > 1) fail(Failure::Arguments, "'-' can be named once in --rays");
  args.world.note_files();
  if (!args.ray_masks.empty() && args.ray_masks.size() != args.rays.size())
    fail(Failure::Arguments, "--rays names {} files and --ray-masks {}; expected as many", args.rays.size(),
         args.ray_masks.size());
  if (!args.ray_masks.empty() && !args.part.empty())
    fail(Failure::Arguments, "--ray-masks and --part: give one of them");
  if (!args.masks.empty()) args.world.files.reads("--masks", args.masks);
  for (const std::string& masks : args.ray_masks) args.world.files.reads("--ray-masks", masks);
  for (const std::string& rays : args.rays) args.world.files.reads("--rays", rays);
  for (std::string& out : args.out) out = args.world.files.must_write("--out", out).string();
  for (const std::string& rays : args.rays)
    if (rays != "-") open_rays(args, rays);
}

/// Returns the concrete query by which a file was traced: for method auto, by the class of its first rays.
Query run_as(const DeviceScene& world, Query query, const FileTrace& done) {
  query.rays = done.ray_class;
  return world.tracer().resolve(query, done.rays);
}

/// Prints what tracing a file gave.
void print_result(DeviceScene& world, const std::string& out, const FileTrace& done, Query query, bool verbose) {
  const double mrays = done.times.device_ms > 0 ? double(done.rays) / done.times.device_ms * 1e-3 : 0;
  say("{}: {} rays, {} hits, {:.3f} ms on the device, {:.2f} Mrays/s\n", out, done.rays, done.hits,
      done.times.device_ms, mrays);
  if (!verbose) return;
  const Variant variant = world.tracer().variant(run_as(world, query, done));
  say("  {} on {} ({}), subgroup {}\n", variant.name(), world.device().name, world.device().driver,
      variant.config.subgroup);
  if (query.method == kAuto)
    say("  auto: {}, for {} rays of class {}\n", variant.method->name, done.rays, done.ray_class);
  if (done.times.retraced)
    say("  {} rays were cut short by the driver and traced again in pieces\n", done.times.retraced);
}

nlohmann::json record_of(const DeviceScene& world, const TraceArgs& args, std::size_t i, const FileTrace& done,
                         Query query) {
  query.rays = done.ray_class;
  return {{"scene", world.scene().name},
          {"rays", args.rays[i]},
          {"any", args.rows.query().any != 0},
          {"method", query.method},
          {"knobs", query.knobs},
          {"variant", world.tracer().variant(query).name()},
          {"numeric", query.numeric},
          {"ray_count", done.rays},
          {"hits", done.hits},
          {"dead", done.dead.all()},
          {"trace_ms", done.times.device_ms},
          {"mrays_per_s", done.times.device_ms > 0 ? double(done.rays) / done.times.device_ms * 1e-3 : 0},
          {"retraced", done.times.retraced}};
}

/// Checks the options that ask for more than one hit.
void check_crossings(const TraceArgs& args) {
  if (!args.crossings()) return;
  const BallotQuery& asked = args.rows.query();
  if (args.count + args.all + (asked.first != 0) + (asked.last != 0) + (asked.any != 0) > 1)
    fail(Failure::Arguments, "--count, --all, --first, --last and --any: give one of them");
  if (args.t_double)
    fail(Failure::Arguments,
         "--t-double: of nearest and any hits alone; leave --count, --all, --first, --last, masks, --cull "
         "and --alpha out");
  if (args.query.method != kDefaultMethod || !args.query.knobs.empty())
    fail(Failure::Arguments,
         "--count, --all, --first, --last, masks, --cull and --alpha have a kernel of their own; leave --method and "
         "--knob out");
  args.crossing();
}

/// Finds the crossings of each file of rays.
int run_crossings(TraceArgs& args) {
  Opened opened = open_scene(args.world);
  const InterruptGuard interrupt;
  nlohmann::json json = record_header(*opened.world, opened.load_s);
  const std::vector<std::uint32_t> masks = args.masks.empty() ? std::vector<std::uint32_t>() : read_masks(args.masks);
  const BallotQuery& asked = args.rows.query();
  CrossingsWanted want{.as = args.count                              ? CrossingsWanted::Counts
                             : args.all || asked.first || asked.last ? CrossingsWanted::Lists
                                                                     : CrossingsWanted::Hits,
                       .query = args.crossing(),
                       .last = asked.last};
  want.query.any = asked.any != 0;
  want.query.triangle_masks = masks;
  if (!args.masks.empty() && masks.size() != opened.world->triangle_count())
    fail(Failure::Arguments, "--masks {}: found {} masks; expected one for each of the {} triangles", args.masks,
         masks.size(), opened.world->triangle_count());
  for (std::size_t i = 0; i < args.rays.size(); ++i) {
    CrossingTrace done;
    std::vector<std::uint32_t> ray_masks;
    if (!args.ray_masks.empty()) ray_masks = read_masks(args.ray_masks[i]);
    want.ray_masks = ray_masks;
    {
      ProgressBar bar("tracing " + args.rays[i]);
      done = trace_crossings(*opened.world, open_rays(args, args.rays[i]), args.out[i], want,
                             [&](double share) { interrupt.stop("tracing"), bar.update(share); });
    }
    const double mrays = done.times.device_ms > 0 ? double(done.rays) / done.times.device_ms * 1e-3 : 0;
    say("{}: {} rays, {} crossings, {:.3f} ms on the device, {:.2f} Mrays/s\n", args.out[i], done.rays, done.crossings,
        done.times.device_ms, mrays);
    warn_of_dead(args.rays[i], done.rays, done.dead);
    json["records"].push_back({{"rays", args.rays[i]},
                               {"ray_count", done.rays},
                               {"crossings", done.crossings},
                               {"dead", done.dead.all()},
                               {"trace_ms", done.times.device_ms}});
  }
  write_json(args.world.json, *opened.world, json);
  return finish(*opened.world);
}

int run_trace(TraceArgs& args) {
  Query query = args.query.query();
  query.want = args.rows.query().any ? Want::Any : Want::Nearest;
  check_crossings(args);
  check_files(args);
  if (args.crossings()) return run_crossings(args);
  Opened opened = open_scene(args.world, {query});
  DeviceScene& world = *opened.world;
  const InterruptGuard interrupt;
  nlohmann::json json = record_header(world, opened.load_s);
  for (std::size_t i = 0; i < args.rays.size(); ++i) {
    FileTrace done;
    {
      ProgressBar bar(args.rays.size() == 1 ? "tracing" : "tracing " + args.rays[i]);
      done = trace_file(world, open_rays(args, args.rays[i]), args.out[i], query, args.t_double,
                        [&](double share) { interrupt.stop("tracing"), bar.update(share); });
    }
    print_result(world, args.out[i], done, query, args.verbose);
    warn_of_dead(args.rays[i], done.rays, done.dead);
    json["records"].push_back(record_of(world, args, i, done, query));
  }
  if (args.verbose) print_longest(world.context()->longest_pass());
  write_json(args.world.json, world, json);
  return finish(world);
}

}  // namespace

void add_trace(CLI::App& app, int& result) {
  const auto [cmd, args] =
      add_command<TraceArgs>(app, result, "trace", run_trace, "traces a batch of rays: NumPy rays in, NumPy hits out");
  cmd->footer(
      "Examples: ballot trace scenes/cornell.gltf --rays rays.npy --out hits.npy\n"
      "          make_rays | ballot trace scenes/cornell.gltf --rays - --out - | use_hits\n"
      "Rays are float32 (n,8), or float64; a row is ox oy oz t_min dx dy dz t_max, or without bounds (n,6): origin, "
      "direction.\n"
      "Directions need not have unit length; t is in multiples of the direction. Hits are\n"
      "[('t','<f4'),('prim','<u4'),('u','<f4'),('v','<f4')], with prim 4294967295 on a miss;\n"
      "'ballot info SCENE --triangles T.npy' writes the triangles that prim numbers. Keep rays of like direction next\n"
      "to each other: coherent rays trace faster. Memory is bounded, whatever the number of rays.");
  args->world.add_to(*cmd, true);
  args->query.add_to(*cmd);
  cmd->add_option("--rays", args->rays, "FILE.npy with the rays, or several; '-': standard input")->required();
  cmd->add_option("--out", args->out, "FILE.npy for the hits, one for each of --rays; '-': standard output")
      ->required();
  cmd->add_option("--part", args->part,
                  "I/N: trace part I of N equal parts of the rays, I from 0; for jobs on several machines");
  cmd->add_flag("--count", args->count,
                "count all triangles that each ray crosses: uint32 (n,). A ray through an edge or vertex of a closed\n"
                "surface crosses it once there");
  cmd->add_flag("--all", args->all,
                "list all of them, ray by ray in order of t: [('ray','<u4'),('t','<f4'),('prim','<u4'),('u','<f4'),\n"
                "('v','<f4')]");
  args->rows.add_to(*cmd, {"any", "first", "last", "cull", "alpha"});
  cmd->add_flag("--t-double", args->t_double,
                "t of hits in double, where the ray as it was given meets the triangle's plane: [('t','<f8'),\n"
                "('prim','<u4'),('u','<f4'),('v','<f4')]");
  cmd->add_option(
      "--masks", args->masks,
      "FILE.npy with a mask for each triangle, uint32 (n,); a triangle is left out if it shares no bit with\n"
      "the ray's");
  cmd->add_option("--ray-masks", args->ray_masks, "FILE.npy with a mask for each ray, one file for each of --rays");
  add_verbose(*cmd, args->verbose);
  show_first(*cmd, {"--rays", "--out", "--any", "--count", "--all", "--first", "--part", "--method", "--numeric",
                    "--device", "--json", "--verbose"});
}

}  // namespace ballot::cli
