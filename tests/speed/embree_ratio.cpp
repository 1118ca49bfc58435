// Compares Ballot with Embree on the same rays, interleaved in one process. On CPU devices only the ratio counts.
//
// Rays: the ray kinds of `ballot bench`. Embree: robust, high build quality (spatial splits), called for single rays
// and for packets of 8 and 16 neighbours, with the coherent and the incoherent flag. The time to fill packets counts.
// Ballot: the device time of the traversal. Figures are medians over the repeats and geometric means over the views.
#include <chrono>
#include <cmath>
#include <map>

#include "tests/speed/embree_calls.h"
#include "tests/speed/program.h"
#include "tools/bench/markdown.h"

namespace ballot::speed {
namespace {

using Clock = std::chrono::steady_clock;
/// Milliseconds by the name of the Embree call or of Ballot's method and mode.
using Samples = std::map<std::string, std::vector<double>>;

struct Args {
  std::vector<std::string> scenes, views{"view0"}, rays{"primary", "shadow", "ao", "diffuse"};
  std::vector<std::string> methods{"auto", "while-while"}, modes{"plain", "watertight"};
  std::uint32_t size = 512, repeats = 9, ao_rays = 1;
  float ao_radius = 0.1f;
  unsigned threads = std::thread::hardware_concurrency();
  std::string device = "cpu";
};

std::string label(const std::string& method, const std::string& mode) { return method + ", " + mode; }

/// Returns the query of a method such as "packet-wide:fallback=0" in a numeric mode.
Query query_of(const std::string& item, const std::string& mode) {
  const std::size_t colon = item.find(':'), equals = item.find('=');
  Query query{.method = item.substr(0, colon), .numeric = mode};
  if (equals != std::string::npos) query.knobs[item.substr(colon + 1, equals - colon - 1)] = item.substr(equals + 1);
  return query;
}

Samples measure(DeviceScene& world, const EmbreeTracer& embree, RayBatch& batch, const Args& args) {
  const std::vector<Ray> rays = batch.rays();
  std::vector<Hit> hits(rays.size());
  for (const std::string& mode : args.modes)
    for (const std::string& method : args.methods) world.trace(batch, query_of(method, mode));  // compiles, calibrates
  Samples samples;
  for (std::uint32_t r = 0; r < args.repeats; ++r) {
    for (const EmbreeCall& call : kEmbreeCalls) {
      const auto start = Clock::now();
      embree.trace(call, batch.any(), rays, hits, args.threads);
      samples[call.name()].push_back(std::chrono::duration<double, std::milli>(Clock::now() - start).count());
    }
    for (const std::string& mode : args.modes)
      for (const std::string& method : args.methods)
        samples[label(method, mode)].push_back(world.trace(batch, query_of(method, mode)).device_ms);
  }
  return samples;
}

/// Geometric means over views of the rays per second.
struct Speeds {
  std::map<std::string, double> log_sum;
  int views = 0;
  void add(const Samples& samples, std::size_t rays) {
    for (const auto& [name, ms] : samples) log_sum[name] += std::log(double(rays) / median(ms) * 1e-3);
    ++views;
  }
  double of(const std::string& name) const { return std::exp(log_sum.at(name) / views); }
  std::string best_embree() const {
    const auto speed = [&](const EmbreeCall& call) { return of(call.name()); };
    return std::ranges::max_element(kEmbreeCalls, {}, speed)->name();
  }
};

void add_row(bench::Table& table, const std::string& scene, const std::string& rays, const Speeds& speeds,
             const Args& args) {
  const double one = speeds.of(kEmbreeCalls[0].name());
  const std::string best = speeds.best_embree();
  std::vector<std::string> cells{scene, rays, best, bench::figure(one), bench::figure(speeds.of(best))};
  for (const std::string& mode : args.modes)
    for (const std::string& method : args.methods) {
      const double ours = speeds.of(label(method, mode));
      cells.push_back(fmt::format("{:.2f}, {:.2f}", ours / one, ours / speeds.of(best)));
    }
  table.row(std::move(cells));
}

void run(const Args& args) {
  std::vector<std::string> header{"scene", "rays", "Embree's best", "Embree 1", "best"};
  for (const std::string& mode : args.modes)
    for (const std::string& method : args.methods) header.push_back(label(method, mode));
  bench::Table table(header, 3);
  std::string device;
  for (const std::string& file : args.scenes) {
    DeviceScene world(load_scene(file), {.device = args.device});
    const EmbreeTracer embree(world.scene().triangles);
    device = world.device().name + " (" + world.device().driver + ")";
    for (const std::string& rays : args.rays) {
      Speeds speeds;
      for (const std::string& view : args.views) {
        const auto batch = world.make_batch(find_view(world.scene(), view), find_ray_kind(rays), args.size, args.size,
                                            {.ao_rays = args.ao_rays, .ao_radius = args.ao_radius});
        if (batch->count() > 0) speeds.add(measure(world, embree, *batch, args), batch->count());
      }
      if (speeds.views) add_row(table, world.scene().name, rays, speeds, args);
    }
  }
  fmt::print(
      "{}, {} x {}, {} Embree threads, {} repeats, views {}\n"
      "Embree in Mrays/s; Ballot as times Embree 1, times Embree's best\n\n{}",
      device, args.size, args.size, args.threads, args.repeats, fmt::join(args.views, " "), table.text());
}

}  // namespace
}  // namespace ballot::speed

int main(int argc, char** argv) {
  ballot::speed::Args args;
  CLI::App app("Compares Ballot with Embree on the same rays, in turn in one process");
  app.add_option("SCENE", args.scenes, "scene files")->required();
  app.add_option("--views", args.views, "cameras of the scenes [view0]")->delimiter(',');
  app.add_option("--rays", args.rays, "ray kinds [primary,shadow,ao,diffuse]")->delimiter(',');
  app.add_option("--methods", args.methods, "methods of Ballot, METHOD or METHOD:KNOB=VALUE [auto,while-while]")
      ->delimiter(',');
  app.add_option("--numeric", args.modes, "numeric modes of Ballot [plain,watertight]")->delimiter(',');
  app.add_option("--size", args.size, "width and height in pixels [512]")->check(CLI::Range(1, 16384));
  app.add_option("--repeat", args.repeats, "interleaved repeats [9]")->check(CLI::Range(1, 10000));
  app.add_option("--ao-rays", args.ao_rays, "rays of kind ao per hit [1]")->check(CLI::Range(1, 64));
  app.add_option("--ao-radius", args.ao_radius, "length of ao rays as a share of the scene's diagonal [0.1]");
  app.add_option("--threads", args.threads, "threads of Embree [number of cores]; LP_NUM_THREADS sets lavapipe's")
      ->check(CLI::Range(1, 1024));
  app.add_option("--device", args.device, "device of Ballot [cpu]");
  return ballot::speed::run_program(app, argc, argv, "ballot_embree_ratio", [&] { ballot::speed::run(args); });
}
