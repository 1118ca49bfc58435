// Measures scenes of instances: milliseconds to refit or build the top-level tree, on the host or the device, after all
// instances have moved, and of tracing primary and incoherent rays, beside the scene of moved copies where that fits.
// Figures are medians.
//
// The scene: one mesh, a bumpy sphere, many times on a wavy ground, turned and scaled, seen from above at a slant.
// Incoherent rays start at points among the instances, in all directions.
#include <chrono>
#include <cmath>
#include <random>

#include "engine/answer/tracer.h"
#include "engine/tree/host/forest.h"
#include "tests/speed/program.h"
#include "tools/bench/markdown.h"

namespace ballot::speed {
namespace {

using Clock = std::chrono::steady_clock;

struct Args {
  std::vector<std::uint32_t> instances{1'000, 10'000, 100'000};
  std::vector<std::string> methods{"while-while", "packet", "frontier", "auto"};
  std::uint32_t triangles = 10'000, size = 1024, repeats = 9, flat = 4'000'000;
  std::string device = "gpu", numeric = std::string(kDefaultNumeric), top = "auto";
};

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// About `count` triangles of a bumpy sphere of radius 1.
UnsetVector<Triangle> bumpy_sphere(std::uint32_t count) {
  const auto rows = std::uint32_t(std::max(3.0, std::round(std::sqrt(count / 4.0)))), columns = 2 * rows;
  const auto at = [&](std::uint32_t i, std::uint32_t k) {
    const double a = M_PI * i / rows, b = 2 * M_PI * (k % columns) / columns;
    const double r = 1 + 0.1 * std::sin(7 * a) * std::sin(5 * b);
    return glm::vec3(r * std::sin(a) * std::cos(b), r * std::cos(a), r * std::sin(a) * std::sin(b));
  };
  UnsetVector<Triangle> out;
  for (std::uint32_t i = 0; i < rows; ++i)
    for (std::uint32_t k = 0; k < columns; ++k) {
      if (i > 0) out.push_back({at(i, k), at(i, k + 1), at(i + 1, k)});
      if (i + 1 < rows) out.push_back({at(i, k + 1), at(i + 1, k + 1), at(i + 1, k)});
    }
  return out;
}

/// Turned and scaled instances, about 2 apart, at a time of an animation.
std::vector<Transform> transforms_at(std::uint32_t count, double time) {
  const auto side = std::uint32_t(std::ceil(std::sqrt(double(count))));
  std::vector<Transform> all(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const double x = 2.0 * (i % side) - side, z = 2.0 * (i / side) - side;
    const double turn = 2.4 * i + time, c = std::cos(turn), s = std::sin(turn), scale = 0.6 + 0.4 * std::sin(1.7 * i);
    const double rows[3][4] = {{c * scale, 0, s * scale, x + 0.3 * std::sin(0.7 * i + time)},
                               {0, scale * (1 + 0.3 * std::sin(3.1 * i)), 0, std::sin(0.2 * x) + std::cos(0.3 * z)},
                               {-s * scale, 0, c * scale, z + 0.3 * std::cos(1.3 * i + time)}};
    for (int r = 0; r < 3; ++r)
      for (int k = 0; k < 4; ++k) all[i].m[r][k] = float(rows[r][k]);
  }
  return all;
}

/// The primary rays of size x size pixels in tiles of 8 x 8.
std::vector<Ray> primary_rays(const Bounds& b, std::uint32_t size) {
  const glm::vec3 middle = 0.5f * (b.lo + b.hi), extent = b.hi - b.lo;
  const glm::vec3 eye = middle + glm::vec3(0, 0.3f * extent.z, 0.55f * extent.z);
  const glm::vec3 z = glm::normalize(eye - middle), x = glm::normalize(glm::cross(glm::vec3(0, 1, 0), z)),
                  y = glm::cross(z, x);
  std::vector<Ray> rays;
  rays.reserve(std::size_t(size) * size);
  for (std::uint32_t ty = 0; ty < size; ty += 8)
    for (std::uint32_t tx = 0; tx < size; tx += 8)
      for (std::uint32_t i = 0; i < 64; ++i) {
        const float u = float(tx + i % 8) + 0.5f, v = float(ty + i / 8) + 0.5f;
        if (tx + i % 8 >= size || ty + i / 8 >= size) continue;
        const glm::vec3 dir = (2 * u / float(size) - 1) * 0.7f * x - (2 * v / float(size) - 1) * 0.7f * y - z;
        rays.push_back({eye, 0, dir, 3e38f});
      }
  return rays;
}

std::vector<Ray> incoherent_rays(const Bounds& b, std::size_t count) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(0, 1);
  std::vector<Ray> rays(count);
  for (Ray& r : rays) {
    for (int k = 0; k < 3; ++k) r.origin[k] = b.lo[k] + unit(random) * (b.hi[k] - b.lo[k]);
    r.dir = {unit(random) - 0.5f, unit(random) - 0.5f, unit(random) - 0.5f};
    r.t_min = 0, r.t_max = 3e38f;
  }
  return rays;
}

/// Milliseconds of tracing rays that lie on the device.
double trace_ms(Context& gpu, Tracer& tracer, std::span<const Ray> rays, const Query& query, std::uint32_t repeats) {
  Buffer<Ray> from(gpu, rays.size(), Access::Storage, "rays");
  Buffer<Hit> to(gpu, rays.size(), Access::Storage, "hits");
  from.upload(rays);
  std::vector<double> ms;
  for (std::uint32_t i = 0; i <= repeats; ++i) {
    const double spent = tracer.trace(from, to, std::uint32_t(rays.size()), query).device_ms;
    if (i > 0) ms.push_back(spent);
  }
  return median(ms);
}

void add_rows(bench::Table& table, const std::string& scene, Context& gpu, Tracer& tracer, const Bounds& bounds,
              const Args& args) {
  const std::vector<Ray> primary = primary_rays(bounds, args.size), others = incoherent_rays(bounds, primary.size());
  for (const std::string& method : args.methods) {
    const Query query{.method = method, .numeric = args.numeric};
    const double p = trace_ms(gpu, tracer, primary, query, args.repeats),
                 o = trace_ms(gpu, tracer, others, query, args.repeats);
    table.row({scene, method, bench::figure(p), bench::figure(double(primary.size()) / p * 1e-3), bench::figure(o),
               bench::figure(double(others.size()) / o * 1e-3)});
  }
}

void run_flat(bench::Table& table, Context& gpu, const Forest& forest, const Args& args) {
  UnsetVector<Triangle> copies;
  for (std::uint32_t prim = 0; prim < forest.triangle_count(); ++prim)
    copies.push_back(forest.triangle(forest.place_of(prim)));
  const Bvh bvh = build_bvh(copies, {.builder = BuilderId::Balanced});
  Tracer tracer(gpu, bvh, copies, facts_of(bvh));
  add_rows(table, "moved copies", gpu, tracer, forest.top_facts().bounds, args);
}

void run_count(Context& gpu, std::uint32_t count, const Args& args) {
  std::vector<Placement> placements;
  for (const Transform& t : transforms_at(count, 0)) placements.push_back({0, t});
  const auto start = Clock::now();
  Forest forest({bumpy_sphere(args.triangles)}, placements,
                [](std::span<const Triangle> t) { return build_bvh(t, {.builder = BuilderId::Balanced}); });
  const double made = ms_since(start);
  Tracer tracer(gpu, forest);
  tracer.tree().top(kernel_config_for(find_method(kPlainestMethod), find_numeric(args.numeric), gpu.info()).fetch);
  if (args.top != "auto") tracer.tree().set_moves_on_device(args.top == "device");
  std::vector<double> move, tree, device;
  for (std::uint32_t i = 0; i <= args.repeats; ++i) {  // the first one makes buffers and kernels
    const std::vector<Transform> transforms = transforms_at(count, 0.1 * (i + 1));
    const auto begin = Clock::now();
    tracer.move_instances(transforms);
    gpu.finish();
    if (i == 0) continue;
    move.push_back(ms_since(begin)), tree.push_back(forest.top_facts().build_s * 1e3);
    if (const TopBuilder* on_device = tracer.tree().top_builder()) device.push_back(on_device->move_ms());
  }
  fmt::print("\n{} instances of {} triangles, {} in all, depth {} over {}: made in {} ms\n", count,
             forest.meshes()[0].triangles.size(), forest.triangle_count(), forest.top_facts().depth,
             forest.meshes()[0].bvh->stats.depth, bench::figure(made));
  fmt::print("all moved, on the {}: {} ms in all, of which {} for the tree{}; its cost is {} times that when built\n\n",
             tracer.tree().moves_on_device() ? "device" : "host", bench::figure(median(move)),
             bench::figure(median(tree)),
             device.empty() ? "" : fmt::format(", {} on the device", bench::figure(median(device))),
             bench::figure(forest.top_facts().cost / forest.top_facts().built_cost));
  bench::Table table({"scene", "method", "primary ms", "Mrays/s", "incoherent ms", "Mrays/s"}, 2);
  add_rows(table, "instances", gpu, tracer, forest.top_facts().bounds, args);
  if (forest.triangle_count() <= args.flat) run_flat(table, gpu, forest, args);
  fmt::print("{}", table.text());
  std::fflush(stdout);
}

void run(const Args& args) {
  Context gpu(ContextOptions{.device = args.device});
  fmt::print("{} ({}), {} x {} rays, mode {}, medians of {}\n", gpu.info().name, gpu.info().driver, args.size,
             args.size, args.numeric, args.repeats);
  for (const std::uint32_t count : args.instances) run_count(gpu, count, args);
}

}  // namespace
}  // namespace ballot::speed

int main(int argc, char** argv) {
  ballot::speed::Args args;
  CLI::App app("Measures scenes of instances: the top-level tree, and tracing");
  app.add_option("--instances", args.instances, "numbers of instances [1000,10000,100000]")->delimiter(',');
  app.add_option("--triangles", args.triangles, "triangles of the mesh [10000]")->check(CLI::Range(12, 100'000'000));
  app.add_option("--methods", args.methods, "traversal methods [while-while,packet,frontier,auto]")->delimiter(',');
  app.add_option("--numeric", args.numeric, "numeric mode [watertight]");
  app.add_option("--size", args.size, "width and height in pixels [1024]")->check(CLI::Range(1, 16384));
  app.add_option("--repeats", args.repeats, "repeats of each measurement [9]")->check(CLI::Range(1, 100000));
  app.add_option("--top", args.top, "where the top-level tree follows: auto, host, device [auto]")
      ->check(CLI::IsMember({"auto", "host", "device"}));
  app.add_option("--flat", args.flat, "scenes of up to this many triangles are also traced as moved copies [4000000]");
  app.add_option("--device", args.device, "device [gpu]");
  return ballot::speed::run_program(app, argc, argv, "ballot_instance_speed", [&] { ballot::speed::run(args); });
}
