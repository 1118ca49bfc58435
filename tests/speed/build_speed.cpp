// Measures the builder `device`: milliseconds of each pass on the device, for wavy grids of any size and for scenes.
// Also measures wide trees, refits and updates, and how fast the trees of the given builders are traced. Times are
// medians over the repeats. Two kinds of work are timed only once: the build before a trace or before refits on the
// host, and the host's encoding of wide trees.
//
// "device" is the sum of all passes, from triangles on the device to the pairs and leaves that kernels read. "wall" is
// that time as the host sees it. It includes the host's wait for the size of the tree. Refits move every vertex up or
// down by a wave, and back. Its height is a hundredth of the scene's longest side.
#include <chrono>
#include <cmath>

#include "engine/tree/device/device_build.h"
#include "engine/tree/host/padding.h"
#include "engine/tree/host/refit.h"
#include "tests/speed/program.h"
#include "tools/bench/markdown.h"

namespace ballot::speed {
namespace {

using Clock = std::chrono::steady_clock;

struct Args {
  std::vector<std::string> scenes;
  std::vector<std::uint32_t> grids{10'000, 100'000, 1'000'000, 4'000'000, 10'000'000};
  std::vector<std::string> builders{"device", "balanced", "fast"},
      rays{"primary", "shadow", "ao", "diffuse", "secondary"};
  std::vector<std::string> methods{"while-while"};
  std::uint32_t size = 1024, repeats = 9, traced = 1'000'000, bits = 0;
  std::string device = "gpu";
};

/// Returns about `count` triangles of a wavy height field over [-1, 1] x [-1, 1].
Scene wavy_grid(std::uint32_t count) {
  const auto side = std::uint32_t(std::lround(std::sqrt(count / 2.0)));
  const auto at = [&](std::uint32_t x, std::uint32_t z) {
    const double u = 2.0 * x / side - 1, v = 2.0 * z / side - 1;
    return glm::vec3(u, 0.1 * std::sin(9 * u + 4 * v) + 0.05 * std::sin(23 * v - 7 * u), v);
  };
  Scene scene;
  scene.name = fmt::format("grid {}", 2 * side * side);
  for (std::uint32_t z = 0; z < side; ++z)
    for (std::uint32_t x = 0; x < side; ++x) {
      scene.triangles.push_back({at(x, z), at(x, z + 1), at(x + 1, z)});
      scene.triangles.push_back({at(x + 1, z), at(x, z + 1), at(x + 1, z + 1)});
    }
  finish_scene(scene);
  return scene;
}

/// Moves every vertex a little up and down, as a wave does.
void make_waves(UnsetVector<Triangle>& triangles, const Bounds& bounds) {
  const glm::vec3 sides = bounds.hi - bounds.lo;
  const float longest = std::max({sides.x, sides.y, sides.z}), height = 0.01f * longest, waves = 40 / longest;
  for (Triangle& t : triangles)
    for (glm::vec3& v : t) v.y += height * std::sin(waves * (v.x + 0.6f * v.z));
}

/// The times of each repeat, in milliseconds: of each pass by name, of their sum, and on the wall clock. `built` is the
/// tree.
struct Spent {
  std::vector<std::pair<std::string, std::vector<double>>> passes;
  std::vector<double> device, wall;
  BuiltTree built;

  void add(const std::string& name, double ms) {
    const auto found = std::ranges::find(passes, name, [](const auto& p) { return p.first; });
    (found == passes.end() ? passes.emplace_back(name, std::vector<double>()) : *found).second.push_back(ms);
  }
};

/// Repeats the work for a second, so that an idle device can raise its clock. The first time compiles kernels and
/// touches memory.
void warm_up(const std::function<void()>& work) {
  constexpr auto kWarmUp = std::chrono::seconds(1);
  const auto start = Clock::now();
  do work();
  while (Clock::now() - start < kWarmUp);
}

Spent measure(Context& gpu, const Scene& scene, const Args& args) {
  const auto count = std::uint32_t(scene.triangles.size());
  const Buffer<Triangle> triangles = DeviceBuilder::upload(gpu, scene.triangles);
  const TreeAccess access =
      kernel_config_for(find_method("while-while"), find_numeric(kDefaultNumeric), gpu.info(), {}).tree_access();
  DeviceBuilder builder(gpu);
  if (args.bits) builder.set_code_bits(args.bits);
  Spent spent;
  spent.built = builder.build(triangles, count, {});
  const std::size_t texels = std::size_t(spent.built.pairs) * PAIR_TEXELS(std::uint32_t(access.layout));
  Buffer<glm::uvec4> pairs(gpu, texels, Access::Storage, "pairs");
  Buffer<glm::uvec4> leaves(gpu, spent.built.leaf_texels, Access::Storage, "leaves");
  const auto whole = [&] {
    builder.build(triangles, count, {});
    builder.write(access.layout, access.padding, pairs, leaves);
    gpu.finish();
  };
  warm_up(whole);
  for (std::uint32_t i = 0; i < args.repeats; ++i) {
    const auto start = Clock::now();
    whole();
    const double wall = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
    double sum = 0;
    for (const PassMs* passes : {&builder.build_ms(), &builder.write_ms()})
      for (const auto& [name, ms] : *passes) spent.add(name, ms), sum += ms;
    spent.device.push_back(sum);
    spent.wall.push_back(wall);
  }
  return spent;
}

/// Measures the two steps in which the device makes a wide tree of its pairs: it collapses them, then encodes the
/// boxes. After a refit only the second step is needed. Also prints the host's time for both steps together.
void measure_wide_trees(Context& gpu, const Scene& scene, const Args& args) {
  DeviceBuild build(gpu, scene.triangles, {});
  Buffer<glm::uvec4> pairs(gpu, std::size_t(build.built().pairs) * PAIR_TEXELS(LAYOUT_INTERLEAVED), Access::Storage,
                           "pairs"),
      leaves(gpu, build.built().leaf_texels, Access::Storage, "leaves");
  build.write(NodeLayout::Interleaved, Padding::Ray, pairs, leaves);
  const PairTree here = encode_pairs(build.bvh(), scene.triangles, NodeLayout::Interleaved);
  for (const TreeFormat& format : kTreeFormats) {
    if (!format.collapsed() || !format.on_device) continue;
    WideEncoder& encoder = build.encoder(format.id);
    Spent spent;
    std::vector<double> collapse, encode;
    WideShape shape = build.collapse(format.id, pairs);
    Buffer<glm::uvec4> texels(gpu, encoder.texels(shape), Access::Storage, "wide tree");
    const auto start = Clock::now();
    const std::size_t size = format.encode(here, 0).size();
    const double host = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
    if (size != texels.size()) return fmt::print("    {}: the host's tree has another size\n", format.name);
    const auto whole = [&] {
      shape = build.collapse(format.id, pairs);
      encoder.write(shape, pairs, texels);
      gpu.finish();
    };
    warm_up(whole);
    for (std::uint32_t i = 0; i < args.repeats; ++i) {
      whole();
      double sum = 0;
      for (const auto& [name, pass_ms] : encoder.collapse_ms()) spent.add(name, pass_ms), sum += pass_ms;
      collapse.push_back(sum);
      encode.push_back(encoder.write_ms().front().second);
    }
    fmt::print("    {} on the device:", format.name);
    for (const auto& [name, ms] : spent.passes) fmt::print(" {} {},", name, bench::figure(median(ms)));
    fmt::print(" collapse {}, encode {}; {} nodes; on the host {}\n", bench::figure(median(collapse)),
               bench::figure(median(encode)), shape.nodes, bench::figure(host));
  }
}

/// Measures refits on the device, in turn to the moved triangles and back. Both sets of triangles lie on the device.
/// Prints the device's time of each pass, and the wall time until the tree is written in the layout that is traced.
void measure_refits(Context& gpu, const Scene& scene, const Args& args) {
  const auto count = std::uint32_t(scene.triangles.size());
  UnsetVector<Triangle> moved = scene.triangles;
  make_waves(moved, scene.bounds);
  const Buffer<Triangle> still = DeviceBuilder::upload(gpu, scene.triangles), waves = DeviceBuilder::upload(gpu, moved);
  const glm::vec3 sides = scene.bounds.hi - scene.bounds.lo;
  const float longest = std::max({sides.x, sides.y, sides.z});
  const TreeAccess access =
      kernel_config_for(find_method("while-while"), find_numeric(kDefaultNumeric), gpu.info(), {}).tree_access();
  DeviceBuilder builder(gpu);
  Spent spent;
  spent.built = builder.build(still, count, {});
  const std::size_t texels = std::size_t(spent.built.pairs) * PAIR_TEXELS(std::uint32_t(access.layout));
  Buffer<glm::uvec4> pairs(gpu, texels, Access::Storage, "pairs");
  Buffer<glm::uvec4> leaves(gpu, spent.built.leaf_texels, Access::Storage, "leaves");
  double decay = 1;
  bool sound = true, to_waves = false;
  const auto whole = [&] {
    to_waves = !to_waves;
    builder.begin_refit(to_waves ? waves : still, longest);
    builder.write(access.layout, access.padding, pairs, leaves);
    sound = builder.end_refit() && sound;
    if (to_waves) decay = builder.built().sah / spent.built.sah;
  };
  warm_up(whole);  // the first refit also finds the parent of each node
  for (std::uint32_t i = 0; i < args.repeats; ++i) {
    const auto start = Clock::now();
    whole();
    const double wall = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
    if (!sound) return fmt::print("    refit: a triangle gains or loses its area\n");
    double sum = 0;
    for (const PassMs* passes : {&builder.refit_ms(), &builder.write_ms()})
      for (const auto& [name, ms] : *passes) spent.add(name, ms), sum += ms;
    spent.device.push_back(sum);
    spent.wall.push_back(wall);
  }
  fmt::print("    refit on the device:");
  for (const auto& [name, ms] : spent.passes) fmt::print(" {} {},", name, bench::figure(median(ms)));
  const double device = median(spent.device);
  fmt::print(" device {}, wall {}; {:.3f} Gtris/s; SAH x {:.3f}\n", bench::figure(device),
             bench::figure(median(spent.wall)), count / device * 1e-6, decay);
}

/// Measures refits of a builder's tree on the host, the check of the triangles before, and the encoding after.
void measure_host_refits(Context& gpu, const Scene& scene, const std::string& name, const Args& args) {
  UnsetVector<Triangle> moved = scene.triangles;
  make_waves(moved, scene.bounds);
  const BuildSettings settings{.builder = find_builder(name).id};
  Bvh bvh = build_bvh(scene.triangles, settings);
  const double built = bvh.stats.sah;
  const TreeAccess access =
      kernel_config_for(find_method("while-while"), find_numeric(kDefaultNumeric), gpu.info(), {}).tree_access();
  PairTree pairs;
  std::vector<double> check, refit, encode;
  double decay = 1;
  const auto since = [](Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  };
  for (std::uint32_t i = 0; i <= args.repeats; ++i) {
    const UnsetVector<Triangle>&from = i % 2 ? moved : scene.triangles, &to = i % 2 ? scene.triangles : moved;
    auto start = Clock::now();
    check_moved(from, bvh.stats.degenerate, to, scene.name);
    check.push_back(since(start));
    start = Clock::now();
    refit_bvh(bvh, to, settings);
    refit.push_back(since(start));
    if (i % 2 == 0) decay = bvh.stats.sah / built;
    start = Clock::now();
    std::vector<Bounds> boxes;
    if (access.padding == Padding::Tree) boxes = padded_boxes(bvh, to);
    pairs = encode_pairs(bvh, to, access.layout, boxes, std::move(pairs));
    encode.push_back(since(start));
  }
  const double sum = median(check) + median(refit) + median(encode);
  fmt::print(
      "    refit on the host, {}: check {}, refit {}, encode {}, sum {}; {:.1f} Mtris/s, refit alone {:.1f}; "
      "SAH x {:.3f}; build {}\n",
      name, bench::figure(median(check)), bench::figure(median(refit)), bench::figure(median(encode)),
      bench::figure(sum), double(scene.triangles.size()) / sum * 1e-3,
      double(scene.triangles.size()) / median(refit) * 1e-3, decay, bench::figure(bvh.stats.build_s * 1e3));
}

/// Measures updates of a DeviceScene whose triangles come from the host: the update alone, and until the first ray
/// after the update is traced.
void measure_updates(const std::shared_ptr<Context>& gpu, const Scene& scene, const std::string& name,
                     const Args& args) {
  DeviceSceneOptions options;
  options.context = gpu;
  options.use_cache = false;
  options.build.builder = find_builder(name).id;
  DeviceScene world(scene, options);
  UnsetVector<Triangle> moved = scene.triangles;
  make_waves(moved, scene.bounds);
  const std::vector<Ray> ray{{{0, 0, 0}, 0, {0, 1, 0}, 1e30f}};
  std::vector<Hit> hit(1);
  world.trace(ray, hit, {.method = "while-while"});
  for (const UpdateModeRow& mode : kUpdateModes) {
    if (mode.id == UpdateMode::Auto) continue;
    std::vector<double> update, traced;
    for (std::uint32_t i = 0; i <= args.repeats; ++i) {
      const auto start = Clock::now();
      moved = world.move(std::move(moved), mode.id);
      const double ms = world.last_update().seconds * 1e3;
      world.trace(ray, hit, {.method = "while-while"});
      if (i == 0) continue;
      update.push_back(ms);
      traced.push_back(std::chrono::duration<double, std::milli>(Clock::now() - start).count());
    }
    fmt::print("    update, {}, {}: {}, to the first ray {}; {:.1f} Mtris/s\n", name, mode.name,
               bench::figure(median(update)), bench::figure(median(traced)),
               double(scene.triangles.size()) / median(traced) * 1e-3);
  }
}

double mrays(DeviceScene& world, const std::string& kind, const std::string& method, const Args& args) {
  const auto batch = world.make_batch(world.scene().views[0], find_ray_kind(kind), args.size, args.size);
  if (batch->count() == 0) return 0;
  std::vector<double> ms;
  for (std::uint32_t i = 0; i <= args.repeats; ++i) {
    const double spent = world.trace(*batch, {.method = method}).device_ms;
    if (i > 0) ms.push_back(spent);
  }
  return double(batch->count()) / median(ms) * 1e-3;
}

void trace_all(const std::shared_ptr<Context>& gpu, const Scene& scene, const Args& args) {
  std::vector<std::string> head{"builder", "method", "build s", "SAH", "depth"};
  for (const std::string& kind : args.rays) head.push_back(kind + " Mrays/s");
  bench::Table table(head, 2);
  for (const std::string& name : args.builders) {
    DeviceSceneOptions options;
    options.context = gpu;
    options.use_cache = false;
    options.build.builder = find_builder(name).id;
    DeviceScene world(scene, options);
    for (const std::string& method : args.methods) {
      std::vector<std::string> row{name, method, bench::figure(world.start_times().bvh_s),
                                   bench::figure(world.bvh_stats().sah), std::to_string(world.bvh_stats().depth)};
      for (const std::string& kind : args.rays) row.push_back(bench::figure(mrays(world, kind, method, args)));
      table.row(row);
    }
  }
  fmt::print("\n{} traced, {} x {}\n\n{}", scene.name, args.size, args.size, table.text());
  std::fflush(stdout);
}

void run(const Args& args) {
  const auto gpu = std::make_shared<Context>(ContextOptions{.device = args.device});
  fmt::print("{} ({}), milliseconds, medians of {}\n\n", gpu->info().name, gpu->info().driver, args.repeats);
  std::vector<std::function<Scene()>> inputs;
  for (const std::uint32_t count : args.grids) inputs.push_back([count] { return wavy_grid(count); });
  for (const std::string& file : args.scenes) inputs.push_back([file] { return load_scene(file); });
  for (const auto& input : inputs) {
    const Scene scene = input();
    const Spent spent = measure(*gpu, scene, args);
    fmt::print("{}:", scene.name);
    for (const auto& [name, ms] : spent.passes) fmt::print(" {} {},", name, bench::figure(median(ms)));
    const double device = median(spent.device);
    fmt::print(" device {}, wall {}; {:.3f} Gtris/s; SAH {:.2f}, depth {}, {} leaves\n", bench::figure(device),
               bench::figure(median(spent.wall)), double(scene.triangles.size()) / device * 1e-6, spent.built.sah,
               spent.built.depth, spent.built.leaves());
    measure_wide_trees(*gpu, scene, args);
    measure_refits(*gpu, scene, args);
    for (const std::string& name : args.builders) {
      if (!builder_of(find_builder(name).id).on_device) measure_host_refits(*gpu, scene, name, args);
      measure_updates(gpu, scene, name, args);
    }
    std::fflush(stdout);
    if (scene.triangles.size() <= args.traced) trace_all(gpu, scene, args);
  }
}

}  // namespace
}  // namespace ballot::speed

int main(int argc, char** argv) {
  ballot::speed::Args args;
  CLI::App app("Measures the builder of the device, refits and updates, and how fast the trees of builders are traced");
  app.add_option("SCENE", args.scenes, "scene files");
  app.add_option("--grids", args.grids, "triangles of wavy grids [1e4 to 1e7]; 0 leaves them out")->delimiter(',');
  app.add_option("--builders", args.builders, "builders whose trees are updated and traced [device,balanced,fast]")
      ->delimiter(',');
  app.add_option("--rays", args.rays, "ray kinds [primary,shadow,ao,diffuse,secondary]")->delimiter(',');
  app.add_option("--methods", args.methods, "traversal methods [while-while]")->delimiter(',');
  app.add_option("--size", args.size, "width and height in pixels [1024]")->check(CLI::Range(1, 16384));
  app.add_option("--repeats", args.repeats, "repeats of each measurement [9]")->check(CLI::Range(1, 100000));
  app.add_option("--traced", args.traced, "trees of up to this many triangles are traced [1000000]");
  app.add_option("--bits", args.bits,
                 "bits of Morton codes, a multiple of 8 from 24 to 64 [by the number of triangles]");
  app.add_option("--device", args.device, "device [gpu]");
  return ballot::speed::run_program(app, argc, argv, "ballot_build_speed", [&] {
    std::erase(args.grids, 0u);
    ballot::speed::run(args);
  });
}
