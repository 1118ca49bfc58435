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

/// Rays that are dead only because some bound is infinite: easily written by mistake, so said aloud.
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
  CLI::App* cmd = app.add_subcommand("trace", "batch ray query: NumPy rays in, NumPy hits out");
  cmd->footer(
      "Rays: float32 (n,8), a row is ox oy oz t_min dx dy dz t_max; directions need not be of unit length, t counts "
      "multiples\n"
      "of them. Hits: [('t','<f4'),('prim','<u4'),('u','<f4'),('v','<f4')], prim 4294967295 on a miss; 'ballot info "
      "SCENE\n"
      "--triangles T.npy' writes the triangles that prim counts. Keep rays that point alike next to each other.");
  args->engine.add_to(*cmd, true);
  args->query.add_to(*cmd);
  cmd->add_option("--rays", args->rays, "input, .npy")->required();
  cmd->add_option("--out", args->out, "output, .npy")->required();
  cmd->add_flag("--any", args->any, "some hit instead of the nearest: visibility, shadows");
  cmd->callback([args, &result] { result = run_trace(*args); });
}

}  // namespace ballot::cli
