// Measures the time of a frame in the viewer: runs LiveImage as a window does, but without the window. The camera turns
// a little with every frame, so each frame is a new picture of one sample. The host learns of it when it has ended.
#include <chrono>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <string>
#include <vector>

#include "engine/scene/device_scene.h"
#include "tests/speed/program.h"
#include "tools/bench/markdown.h"

namespace ballot::speed {
namespace {

using Clock = std::chrono::steady_clock;

struct Args {
  std::vector<std::string> scenes, views{"view0"}, shadings{"eyelight"}, rays{"primary"};
  std::string numeric = "watertight", device = "gpu";
  std::uint32_t size = 1024, frames = 400;
  int rest = 0;  // further samples that a picture gets before the camera turns
};

/// Returns the view after this many steps. It turns to and fro by at most three degrees.
View turned(View view, std::uint32_t step) {
  view.world_from_camera = glm::rotate(view.world_from_camera, 0.05 * std::sin(0.02 * step), glm::dvec3(0, 1, 0));
  return view;
}

struct Frames {
  std::vector<double> wall, generate, trace, shade;  // milliseconds
};

Frames fly(DeviceScene& world, const View& view, const LiveOptions& given, const Args& args) {
  Frames all;
  LiveOptions options = given;
  const std::uint32_t samples = std::uint32_t(args.rest) + 1, warm_up = args.frames / 4;
  options.sample_count = samples;
  for (std::uint32_t i = 0; i < warm_up + args.frames; ++i) {
    options.sample_index = i % samples;
    const auto start = Clock::now();
    const LiveTimes times = world.live().add_sample(turned(view, i / samples), options);
    if (i < warm_up) continue;
    all.wall.push_back(std::chrono::duration<double, std::milli>(Clock::now() - start).count());
    all.generate.push_back(times.generate_ms);
    all.trace.push_back(times.primary_ms + times.trace_ms);
    all.shade.push_back(times.shade_ms);
  }
  return all;
}

void run(const Args& args) {
  bench::Table table({"scene", "view", "rays", "shading", "generate", "trace", "shade", "device", "besides traversal",
                      "wall", "frames/s"},
                     4);
  std::string device;
  for (const std::string& file : args.scenes) {
    DeviceScene world(load_scene(file), {.device = args.device});
    device = world.device().name + " (" + world.device().driver + ")";
    for (const std::string& name : args.views)
      for (const std::string& rays : args.rays)
        for (const std::string& shading : args.shadings) {
          LiveOptions options;
          options.width = options.height = args.size;
          options.rays = rays;
          options.shading = shading;
          options.query.numeric = args.numeric;
          const Frames f = fly(world, find_view(world.scene(), name), options, args);
          const double generate = median(f.generate), trace = median(f.trace), shade = median(f.shade);
          const double sum = generate + trace + shade, wall = median(f.wall);
          table.row({world.scene().name, name, rays, shading, bench::figure(generate), bench::figure(trace),
                     bench::figure(shade), bench::figure(sum), fmt::format("{:.0f} %", 100 * (sum - trace) / sum),
                     bench::figure(wall), fmt::format("{:.0f}", 1e3 / wall)});
        }
  }
  fmt::print("{}, {} x {}, {} arithmetic, {} frames, milliseconds, medians\n\n{}", device, args.size, args.size,
             args.numeric, args.frames, table.text());
}

}  // namespace
}  // namespace ballot::speed

int main(int argc, char** argv) {
  ballot::speed::Args args;
  CLI::App app("Measures the time of a frame in the viewer, without its window");
  app.add_option("SCENE", args.scenes, "scene files")->required();
  app.add_option("--views", args.views, "cameras of the scenes [view0]")->delimiter(',');
  app.add_option("--rays", args.rays, "ray kinds [primary]")->delimiter(',');
  app.add_option("--shading", args.shadings, "shadings [eyelight]")->delimiter(',');
  app.add_option("--numeric", args.numeric, "numeric mode [watertight]");
  app.add_option("--size", args.size, "width and height in pixels [1024]")->check(CLI::Range(1, 16384));
  app.add_option("--frames", args.frames, "measured frames; a quarter as many run before them [400]")
      ->check(CLI::Range(1, 1000000));
  app.add_option("--rest", args.rest, "further samples of a picture before the camera turns again [0]")
      ->check(CLI::Range(0, 100000));
  app.add_option("--device", args.device, "device [gpu]");
  return ballot::speed::run_program(app, argc, argv, "ballot_live_frames", [&] { ballot::speed::run(args); });
}
