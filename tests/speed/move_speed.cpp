// What it takes to move things through the library, from arrays in memory to the first ray that meets them: all
// vertices of one mesh, its triangles, one mesh of many, and instances. One line for each measurement: the median of
// several runs, and the least.
//
//   ballot_move_speed [--device gpu] [--triangles 10000000] [--meshes 1000] [--instances 100000] [--repeat 9]
#include <ballot/ballot.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <vector>

namespace {

/// A grid of about this many triangles over the unit square, whose heights change with `phase`.
struct Grid {
  std::vector<float> positions;
  std::vector<std::uint32_t> indices;

  Grid(std::size_t triangles, float phase) {
    const auto side = std::uint32_t(std::max(1.0, std::sqrt(double(triangles) / 2)));
    for (std::uint32_t y = 0; y <= side; ++y)
      for (std::uint32_t x = 0; x <= side; ++x) {
        const float u = float(x) / float(side), v = float(y) / float(side);
        positions.insert(positions.end(), {u, v, 0.05f * std::sin(20 * u + phase) * std::cos(17 * v)});
      }
    for (std::uint32_t y = 0; y < side; ++y)
      for (std::uint32_t x = 0; x < side; ++x) {
        const std::uint32_t a = y * (side + 1) + x, b = a + side + 1;
        indices.insert(indices.end(), {a, a + 1, b, b, a + 1, b + 1});
      }
  }
  ballot::Mesh mesh() const { return ballot::mesh(positions, indices); }
};

/// Places of a square array of instances, `step` apart.
std::vector<float> places_of(std::size_t count, float step, float lift) {
  const auto side = std::size_t(std::ceil(std::sqrt(double(count))));
  std::vector<float> places;
  for (std::size_t i = 0; i < count; ++i) {
    const float x = step * float(i % side), y = step * float(i / side), z = lift * float(i % 7);
    places.insert(places.end(), {1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z});
  }
  return places;
}

/// Runs move(step) and traces a ray, several times, and prints what a run took after two that are not counted.
template <class Move>
void measure(const char* what, std::size_t count, int repeat, const ballot::Scene& scene, const Move& move) {
  const ballot::Ray down{{0.3f, 0.4f, 50}, 0, {0, 0, -1}, 1000};
  std::vector<ballot::Hit> hit(1);
  std::vector<double> ms;
  std::uint64_t hits = 0;
  for (int step = 0; step < repeat + 2; ++step) {
    const auto start = std::chrono::steady_clock::now();
    move(step);
    hits += scene.trace({&down, 1}, hit).hits;
    ms.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  ms.erase(ms.begin(), ms.begin() + 2);
  std::ranges::sort(ms);
  std::printf("%-44s %10zu %9.3f ms, least %9.3f; %s\n", what, count, ms[ms.size() / 2], ms[0],
              hits == std::uint64_t(repeat) + 2 ? "hit" : "MISSED");
  std::fflush(stdout);
}

struct Args {
  std::size_t triangles = 10'000'000, meshes = 1000, instances = 100'000;
  int repeat = 9;
};

void move_mesh(const ballot::Device& device, const Args& args, const std::string& builder) {
  const Grid here(args.triangles, 0), there(args.triangles, 0.3f);
  for (const char* mode : {"refit", "rebuild"}) {
    ballot::Scene scene(device, {here.mesh()}, {.builder = builder, .updates = mode});
    measure(mode, here.indices.size() / 3, args.repeat, scene,
            [&](int step) { scene.set_vertices(0, step % 2 ? here.positions : there.positions), scene.commit(); });
  }
}

/// The mesh gets other triangles, as many as it had, from arrays here and there.
void replace_mesh(const ballot::Device& device, const Args& args, const std::string& builder) {
  const Grid here(args.triangles, 0);
  ballot::Array<ballot::Vertex> vertices(device, here.positions.size() / 3);
  ballot::Array<std::uint32_t> indices(device, here.indices.size());
  vertices.write({reinterpret_cast<const ballot::Vertex*>(here.positions.data()), vertices.size()});
  indices.write(here.indices);
  for (const bool there : {false, true}) {
    const ballot::Mesh mesh = there ? ballot::mesh(vertices, indices) : here.mesh();
    ballot::Scene scene(device, {mesh}, {.builder = builder});
    measure(there ? "replace, arrays on the device" : "replace", here.indices.size() / 3, args.repeat, scene,
            [&](int) { scene.replace_mesh(0, mesh), scene.commit(); });
  }
}

void move_one_of_many(const ballot::Device& device, const Args& args, const std::string& builder) {
  const Grid here(10'000, 0), there(10'000, 0.3f);
  for (const std::size_t count : {std::size_t{1}, args.meshes}) {
    const std::vector<ballot::Mesh> meshes(count, here.mesh());
    std::vector<std::uint32_t> numbers(count);
    for (std::size_t i = 0; i < count; ++i) numbers[i] = std::uint32_t(i);
    const std::vector<float> places = places_of(count, 1.1f, 0);
    ballot::Scene scene(device, meshes, ballot::instances(places, numbers), {.builder = builder});
    measure("one mesh, of so many", count, args.repeat, scene,
            [&](int step) { scene.set_vertices(0, step % 2 ? here.positions : there.positions), scene.commit(); });
  }
}

void move_instances(const ballot::Device& device, const Args& args) {
  const Grid grid(200, 0);
  const std::vector<float> here = places_of(args.instances, 1.1f, 0), there = places_of(args.instances, 1.1f, 0.2f);
  ballot::Scene scene(device, {grid.mesh()}, ballot::instances(here));
  measure("instances", args.instances, args.repeat, scene,
          [&](int step) { scene.set_transforms(step % 2 ? here : there), scene.commit(); });
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("What it takes to move things through the library");
  std::string device_name, builder = "auto";
  Args args;
  app.add_option("--device", device_name, "as ballot --device");
  app.add_option("--builder", builder, "builder of the trees [auto]");
  app.add_option("--triangles", args.triangles, "of the one mesh that moves whole");
  app.add_option("--meshes", args.meshes, "meshes of 10 000 triangles, of which one moves");
  app.add_option("--instances", args.instances, "instances that move");
  app.add_option("--repeat", args.repeat, "runs of each measurement");
  CLI11_PARSE(app, argc, argv);
  try {
    const ballot::Device device(device_name);
    std::printf("%s, %s; from the call to the first hit\n", device.info().name, device.info().driver);
    move_mesh(device, args, builder);
    replace_mesh(device, args, builder);
    move_one_of_many(device, args, builder);
    move_instances(device, args);
  } catch (const ballot::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return int(error.code());
  }
  return 0;
}
