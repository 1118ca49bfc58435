#include <algorithm>
#include <cmath>

#include "tools/auto_table.h"

namespace ballot::cli {

namespace {

struct TraceArgs {
  EngineArgs engine;
  QueryArgs query;
  std::string rays, out;
  bool any = false;
};

/// Counts the rays that have an infinite bound and are dead for that alone. It is an easy mistake, so the user is
/// warned.
std::size_t count_infinite(const std::vector<Ray>& rays) {
  return std::size_t(
      std::ranges::count_if(rays, [](const Ray& r) { return std::isinf(r.t_max) || std::isinf(r.t_min); }));
}

int run_trace(const TraceArgs& args) {
  Query query = args.query.query();
  query.want = args.any ? Want::Any : Want::Nearest;
  check_writable(args.out);
  const std::vector<Ray> rays = read_rays(args.rays);
  if (const std::size_t n = count_infinite(rays))
    fmt::print(
        stderr,
        "ballot: {}: {} rays have an infinite t_min or t_max and count as misses; use a finite bound such as 1e30\n",
        args.rays, n);
  Opened opened = open_scene(args.engine, {query});
  Engine& engine = *opened.engine;
  std::vector<Hit> hits(rays.size());
  TraceTimes times;
  {
    ProgressBar bar("tracing");
    times = engine.trace(rays, hits, query, [&](double done) { bar.update(done); });
  }
  write_hits(args.out, hits);
  const auto hit_count = std::ranges::count_if(hits, [](const Hit& h) { return h.prim != NO_HIT; });
  if (query.method == kAuto) query.rays = engine.tracer().ray_class(rays);
  const Variant variant = engine.tracer().variant(query);
  const double mrays = times.device_ms > 0 ? double(rays.size()) / times.device_ms * 1e-3 : 0;
  fmt::print("{}: {} rays, {} hits, {:.3f} ms on the device, {:.2f} Mrays/s\n", args.out, rays.size(), hit_count,
             times.device_ms, mrays);
  fmt::print("  {} on {} ({}), subgroup {}\n", variant.name(), engine.device().name, engine.device().driver,
             variant.config.subgroup);
  if (const std::string line = choice_line(engine, query); !line.empty()) fmt::print("  {} ({})\n", line, query.rays);
  if (times.retraced) fmt::print("  {} rays were cut short by the driver and traced again in pieces\n", times.retraced);
  nlohmann::json json = record_header(engine, opened.load_s);
  json["records"].push_back({{"scene", engine.scene().name},
                             {"rays", args.rays},
                             {"any", args.any},
                             {"method", query.method},
                             {"knobs", query.knobs},
                             {"variant", variant.name()},
                             {"numeric", query.numeric},
                             {"ray_count", rays.size()},
                             {"hits", hit_count},
                             {"trace_ms", times.device_ms},
                             {"mrays_per_s", mrays},
                             {"retraced", times.retraced}});
  write_json(args.engine.json, json);
  return finish(engine);
}

}  // namespace

void add_trace(CLI::App& app, int& result) {
  auto args = std::make_shared<TraceArgs>();
  CLI::App* cmd = app.add_subcommand("trace", "traces a batch of rays: NumPy rays in, NumPy hits out");
  cmd->footer(
      "Example: ballot trace scenes/cornell.gltf --rays rays.npy --out hits.npy\n"
      "Rays are float32 (n,8); a row is ox oy oz t_min dx dy dz t_max. Directions need not have unit length; t is in\n"
      "multiples of the direction. Hits are [('t','<f4'),('prim','<u4'),('u','<f4'),('v','<f4')], with prim "
      "4294967295\n"
      "on a miss; 'ballot info SCENE --triangles T.npy' writes the triangles that prim numbers. Keep rays of like\n"
      "direction next to each other: coherent rays trace faster.");
  args->engine.add_to(*cmd, true);
  args->query.add_to(*cmd);
  cmd->add_option("--rays", args->rays, "FILE.npy with the rays")->required();
  cmd->add_option("--out", args->out, "FILE.npy for the hits")->required();
  cmd->add_flag("--any", args->any, "find any hit instead of the closest one: for visibility and shadow rays");
  cmd->callback([args, &result] { result = run_trace(*args); });
}

}  // namespace ballot::cli
