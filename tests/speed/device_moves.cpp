// What it takes to move a mesh whose vertices lie on the device, from the call to the first ray that meets them. One
// line for each measurement: the median of several runs after two that are not counted, and the least.
//
//   ballot_device_moves [--device gpu] [--triangles 1000000,10000000] [--stride 12] [--instances 0] [--repeat 25]
//
// "commit" is the part before the ray, "last submission" the device's time of the last one of it, which has all of a
// refit.
#include <chrono>
#include <cmath>
#include <cstring>

#include "engine/model/mesh_vertices.h"
#include "engine/scene/device_scene.h"
#include "tests/speed/program.h"

namespace ballot::speed {
namespace {

using Clock = std::chrono::steady_clock;

struct Args {
  std::string device = "gpu", builder = "device", method = "auto";
  std::vector<std::uint32_t> triangles{1'000'000, 10'000'000};
  std::uint32_t stride = 12, repeat = 25, instances = 0;
};

/// A wavy grid of about so many triangles over the unit square, which share their vertices.
struct Grid {
  std::uint32_t side;
  std::vector<std::uint32_t> corners = {};

  explicit Grid(std::uint32_t triangles) : side(std::max(1u, std::uint32_t(std::lround(std::sqrt(triangles / 2.0))))) {
    for (std::uint32_t y = 0; y < side; ++y)
      for (std::uint32_t x = 0; x < side; ++x) {
        const std::uint32_t a = y * (side + 1) + x, b = a + side + 1;
        corners.insert(corners.end(), {a, a + 1, b, b, a + 1, b + 1});
      }
  }
  std::vector<glm::vec3> positions(float phase) const {
    std::vector<glm::vec3> all;
    for (std::uint32_t y = 0; y <= side; ++y)
      for (std::uint32_t x = 0; x <= side; ++x) {
        const float u = float(x) / float(side), v = float(y) / float(side);
        all.emplace_back(u, v, 0.05f * std::sin(20 * u + phase) * std::cos(17 * v));
      }
    return all;
  }
};

DeviceVertices put(Context& gpu, const std::vector<glm::vec3>& positions, std::uint32_t stride) {
  std::vector<std::byte> bytes(positions.size() * stride);
  for (std::size_t i = 0; i < positions.size(); ++i)
    std::memcpy(bytes.data() + i * stride, &positions[i], sizeof(glm::vec3));
  auto buffer = std::make_shared<Buffer<std::byte>>(gpu, bytes.size(), Access::Storage, "vertices");
  buffer->upload(bytes);
  return {std::move(buffer), 0, stride, positions.size()};
}

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// The times of each run, in milliseconds.
struct Spent {
  std::vector<double> commit, first_hit, last;
  std::uint64_t submissions = 0, with_ray = 0;  // of the last run
  bool hit = true;
};

Spent measure(DeviceScene& world, MovedVertices mesh, const DeviceVertices (&places)[2], UpdateMode mode,
              const Args& args) {
  Context& gpu = *world.context();
  const std::vector<Ray> down{{{0.3f, 0.4f, 50}, 0, {0, 0, -1}, 1000}};
  std::vector<Hit> hit(1);
  Spent spent;
  for (std::uint32_t step = 0; step < args.repeat + 2; ++step) {
    mesh.there = places[step % 2];
    SceneChange change{.vertices = std::span(&mesh, 1)};
    const std::uint64_t before = gpu.submissions();
    const auto start = Clock::now();
    world.commit(change, mode);
    const double commit = ms_since(start), last = gpu.ended_ms();
    spent.submissions = gpu.submissions() - before;
    world.trace(down, hit, {.method = args.method});
    const double first_hit = ms_since(start);
    spent.with_ray = gpu.submissions() - before;
    spent.hit = spent.hit && hit[0].prim != NO_HIT;
    if (step < 2) continue;
    spent.commit.push_back(commit), spent.first_hit.push_back(first_hit), spent.last.push_back(last);
  }
  return spent;
}

/// The grid in the world, or as often as asked for, one above the other.
Scene scene_of(const Grid& grid, const std::vector<glm::vec3>& positions, std::uint32_t instances) {
  Scene scene;
  scene.name = "grid";
  scene.triangles.resize(grid.corners.size() / 3);
  expand(grid.corners, positions, scene.triangles);
  if (instances > 0) scene.instances.first = {0, scene.triangles.size()}, scene.instances.placed = true;
  for (std::uint32_t i = 0; i < instances; ++i) {
    Transform lifted;
    lifted.m[2][3] = -0.2f * float(i);
    scene.instances.placements.push_back({0, lifted});
  }
  finish_scene(scene);
  return scene;
}

void run(const Args& args) {
  const auto gpu = std::make_shared<Context>(ContextOptions{.device = args.device});
  gpu->set_answers_few(false);  // the ray goes the way of many
  fmt::print("{} ({}), vertices on the device {} bytes apart, ms, medians of {}\n", gpu->info().name,
             gpu->info().driver, args.stride, args.repeat);
  for (const std::uint32_t count : args.triangles) {
    const Grid grid(count);
    const std::vector<glm::vec3> positions = grid.positions(0);
    const DeviceVertices places[2] = {put(*gpu, grid.positions(0.3f), args.stride), put(*gpu, positions, args.stride)};
    MovedVertices mesh;
    mesh.triangles = grid.corners.size() / 3;
    mesh.corners = grid.corners;
    DeviceSceneOptions options;
    options.context = gpu;
    options.use_cache = false;
    options.build.builder = find_builder(args.builder).id;
    DeviceScene world(scene_of(grid, positions, args.instances), options);
    for (const UpdateMode mode : {UpdateMode::Refit, UpdateMode::Rebuild}) {
      const Spent spent = measure(world, mesh, places, mode, args);
      fmt::print(
          "{:7} of {:9}: to the first hit {:.3f}, least {:.3f}; commit {:.3f}, last submission {:.3f}; {} "
          "submissions, {} with the ray{}\n",
          kUpdateModes[std::size_t(mode)].name, mesh.triangles, median(spent.first_hit),
          *std::ranges::min_element(spent.first_hit), median(spent.commit), median(spent.last), spent.submissions,
          spent.with_ray, spent.hit ? "" : "; MISSED");
      std::fflush(stdout);
    }
  }
}

}  // namespace
}  // namespace ballot::speed

int main(int argc, char** argv) {
  ballot::speed::Args args;
  CLI::App app("What it takes to move a mesh whose vertices lie on the device, to the first ray that meets them");
  app.add_option("--device", args.device, "device [gpu]");
  app.add_option("--builder", args.builder, "builder of the trees [device]");
  app.add_option("--triangles", args.triangles, "of the mesh [1e6,1e7]")->delimiter(',')->check(CLI::PositiveNumber);
  app.add_option("--stride", args.stride, "bytes from one vertex to the next, a multiple of 4 [12]")
      ->check(CLI::Range(12, 4096));
  app.add_option("--instances", args.instances, "of the mesh; 0: it lies in the world by itself [0]");
  app.add_option("--method", args.method, "traversal method of the ray [auto]");
  app.add_option("--repeat", args.repeat, "runs of each measurement [25]")->check(CLI::Range(1, 100000));
  return ballot::speed::run_program(app, argc, argv, "ballot_device_moves", [&] { ballot::speed::run(args); });
}
