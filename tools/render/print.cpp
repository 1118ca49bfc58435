#include "tools/render/print.h"

namespace ballot::cli {

namespace {

void print_passes(const RenderTimes& times) {
  for (const PassTime& t : times.passes.all())
    say("    {:<16} {:>10.3f} ms  {:>7} dispatches  {:>12} rays  {:>9.2f} Mrays/s\n", t.name, t.ms, t.dispatches,
        t.rays, t.ms > 0 ? double(t.rays) / t.ms * 1e-3 : 0.0);
}

}  // namespace

nlohmann::json passes_json(const RenderTimes& times) {
  nlohmann::json all = nlohmann::json::array();
  for (const PassTime& t : times.passes.all())
    all.push_back({{"name", t.name}, {"ms", t.ms}, {"dispatches", t.dispatches}, {"rays", t.rays}});
  return all;
}

nlohmann::json wall_json(const Wall& w) {
  return {{"seconds", w.wall_s},
          {"device_s", w.device_s},
          {"host_s", w.host_s()},
          {"film_s", w.film_s},
          {"write_s", w.write_s}};
}

void print_times(const RenderTimes& times, const Wall& wall, bool png) {
  say("    {:.3f} s: generate {:.3f} ms, trace {:.3f} ms, shade {:.3f} ms\n", times.seconds, times.generate_ms,
      times.trace_ms, times.shade_ms);
  print_passes(times);
  say("    wall {:.3f} s: device {:.3f}, host {:.3f}, film {:.3f}, {} {:.3f}\n", wall.wall_s, wall.device_s,
      wall.host_s(), wall.film_s, png ? "EXR and PNG" : "EXR", wall.write_s);
}

void print_kernel(DeviceScene& world, const Query& query) {
  const Query concrete = world.picture_tracer().resolve(query);
  if (query.method == kAuto) say("  auto: {}, for rays of class {}\n", concrete.method, query.rays);
  say("  {}\n", world.picture_tracer().variant(concrete).name());
  const KernelTimes& kernel = world.picture_tracer().kernel(concrete).times();
  say("  kernel: {} bytes of SPIR-V {} in {:.1f} ms, pipeline {:.1f} ms (a CPU driver compiles at the first "
      "dispatch)\n",
      kernel.spirv_bytes, kernel.from_cache ? "from the cache" : "compiled", kernel.spirv_ms, kernel.pipeline_ms);
}

}  // namespace ballot::cli
