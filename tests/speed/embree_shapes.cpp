// Compares Ballot with Embree on spheres, discs and capsules beside triangles, interleaved in one process. On CPU
// devices only the ratios count: shapes' beside that of triangles.
//
// The scenes: a cloud of spheres on a wavy surface, its discs, hair of capsules that stands on it, and the cloud again
// as icosahedra. Rays: those of a camera above, and from each of their hits on spheres one in a random direction, for
// all scenes the same. Embree: as in embree_ratio.cpp, by its best call. Ballot: the device time of the traversal, mode
// watertight. Figures are medians over the repeats.
#include <chrono>
#include <cmath>
#include <map>
#include <random>

#include "tests/cpu/shape_truth.h"
#include "tests/speed/embree_calls.h"
#include "tests/speed/program.h"
#include "tools/bench/markdown.h"

namespace ballot::speed {
namespace {

using Clock = std::chrono::steady_clock;

struct Args {
  std::uint32_t shapes = 100'000, size = 512, repeats = 9;
  std::string device = "cpu", method = "auto";
  unsigned threads = std::thread::hardware_concurrency();
};

/// A scene by Ballot and by Embree.
struct Entry {
  std::string name;
  std::unique_ptr<DeviceScene> world;
  std::unique_ptr<EmbreeTracer> embree;
};

glm::vec3 on_surface(float x, float y) { return {x, y, 0.06f * std::sin(9 * x) * std::cos(7 * y)}; }

/// About `count` shapes of a kind; radii are 0.8 of the spacing, of hair 0.1.
std::vector<Shape> cloud(ShapeKind kind, std::uint32_t count) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> in(-1, 1);
  const auto side = std::uint32_t(std::sqrt(double(count)));
  const float spacing = 2.f / float(side);
  std::vector<Shape> all;
  for (std::uint32_t i = 0; i < side * side; ++i) {
    const float x = spacing * (float(i % side) + 0.3f * in(random)) - 1;
    const float y = spacing * (float(i / side) + 0.3f * in(random)) - 1;
    const glm::vec3 at = on_surface(x, y), lean(in(random), in(random), 2);
    const glm::vec3 normal = glm::cross(on_surface(x + 1e-3f, y) - at, on_surface(x, y + 1e-3f) - at);
    Shape s{{at, 0.8f * spacing}, {0, 0, 0, 0}};
    if (kind == ShapeKind::Discs) s.b = {glm::normalize(normal), 0};
    if (kind == ShapeKind::Capsules) s = {{at, 0.1f * spacing}, {at + 3 * spacing * lean, 0.05f * spacing}};
    all.push_back(s);
  }
  return all;
}

/// The spheres as icosahedra.
UnsetVector<Triangle> icosahedra(std::span<const Shape> spheres) {
  const float g = 0.5f + 0.5f * std::sqrt(5.f);
  const glm::vec3 corner[]{{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                           {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  constexpr std::size_t kFace[][3]{{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                                   {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                                   {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  const float over = 1 / std::sqrt(1 + g * g);
  UnsetVector<Triangle> all;
  for (const Shape& s : spheres)
    for (const auto& f : kFace) {
      Triangle t;
      for (std::size_t k = 0; k < 3; ++k) t[k] = glm::vec3(s.a) + corner[f[k]] * (over * s.a.w);
      all.push_back(t);
    }
  return all;
}

std::vector<Entry> entries(const Args& args) {
  std::vector<Entry> all;
  DeviceSceneOptions options{.device = args.device, .use_cache = false};
  const auto add = [&](std::string name, test::ShapeMesh mesh) {
    Entry e{std::move(name), {}, {}};
    const bool shapes = mesh.kind != ShapeKind::Triangles;
    e.embree = shapes ? std::make_unique<EmbreeTracer>(mesh.kind, mesh.shapes)
                      : std::make_unique<EmbreeTracer>(mesh.triangles);
    Scene scene;
    if (shapes) {
      scene = test::scene_of({std::move(mesh)}, {{0}});
    } else {
      scene.triangles = std::move(mesh.triangles);
      finish_scene(scene);
    }
    e.world = std::make_unique<DeviceScene>(std::move(scene), options);
    options.context = e.world->context();
    all.push_back(std::move(e));
  };
  for (const ShapeKind kind : {ShapeKind::Spheres, ShapeKind::Discs, ShapeKind::Capsules})
    add(std::string(info_of(kind).name), {kind, cloud(kind, args.shapes)});
  add("icosahedra", {ShapeKind::Triangles, {}, icosahedra(cloud(ShapeKind::Spheres, args.shapes))});
  return all;
}

std::vector<Ray> camera_rays(std::uint32_t size) {
  std::vector<Ray> rays;
  for (std::uint32_t i = 0; i < size * size; ++i) {
    const float x = 2 * (float(i % size) + 0.5f) / float(size) - 1, y = 2 * (float(i / size) + 0.5f) / float(size) - 1;
    rays.push_back({{0, -1.6f, 1.1f}, 0, {0.62f * x, 0.82f + 0.45f * y, -0.57f + 0.45f * y}, 1e4f});
  }
  return rays;
}

std::vector<Ray> diffuse_rays(DeviceScene& world, std::span<const Ray> from) {
  std::vector<Hit> hits(from.size());
  world.trace(from, hits, {});
  std::mt19937 random(6);
  std::normal_distribution<float> in;
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (hits[i].prim == NO_HIT) continue;
    glm::vec3 to(in(random), in(random), in(random));
    to.z = std::abs(to.z);
    rays.push_back({from[i].origin + hits[i].t * from[i].dir + glm::vec3(0, 0, 0.01f), 0, glm::normalize(to), 1e4f});
  }
  return rays;
}

/// Returns the share of rays for which Ballot and Embree find the same.
double agreement(const Entry& e, std::span<const Ray> rays, unsigned threads, const Query& query) {
  std::vector<Hit> ours(rays.size()), theirs(rays.size());
  e.world->trace(rays, ours, query);
  e.embree->trace(kEmbreeCalls[0], false, rays, theirs, threads);
  std::size_t same = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) same += ours[i].prim == theirs[i].prim;
  return double(same) / double(rays.size());
}

void run(const Args& args) {
  std::vector<Entry> all = entries(args);
  const std::vector<Ray> primary = camera_rays(args.size), diffuse = diffuse_rays(*all[0].world, primary);
  bench::Table table({"scene", "rays", "Ballot", "Embree 1", "Embree's best", "call", "ratio", "same hits"}, 2);
  for (const bool first : {true, false}) {
    const std::vector<Ray>& rays = first ? primary : diffuse;
    std::vector<Hit> hits(rays.size());
    const Query query{.method = args.method, .rays = first ? "coherent" : "incoherent"};
    std::vector<std::vector<double>> ours(all.size());
    std::vector<std::map<std::string, std::vector<double>>> theirs(all.size());
    for (std::uint32_t r = 0; r <= args.repeats; ++r)
      for (std::size_t i = 0; i < all.size(); ++i) {
        for (const EmbreeCall& call : kEmbreeCalls) {
          const auto start = Clock::now();
          all[i].embree->trace(call, false, rays, hits, args.threads);
          const double ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
          if (r) theirs[i][call.name()].push_back(ms);
        }
        const double ms = all[i].world->trace(rays, hits, query).device_ms;
        if (r) ours[i].push_back(ms);  // the first compiles
      }
    for (std::size_t i = 0; i < all.size(); ++i) {
      const auto speed = [&](const std::vector<double>& ms) { return double(rays.size()) / median(ms) * 1e-3; };
      const auto best = std::ranges::max_element(theirs[i], {}, [&](const auto& t) { return speed(t.second); });
      const double own = speed(ours[i]), other = speed(best->second);
      table.row({all[i].name, first ? "primary" : "diffuse", bench::figure(own),
                 bench::figure(speed(theirs[i][kEmbreeCalls[0].name()])), bench::figure(other), best->first,
                 fmt::format("{:.2f}", own / other),
                 fmt::format("{:.4f}", agreement(all[i], rays, args.threads, query))});
    }
  }
  const DeviceInfo& device = all[0].world->device();
  fmt::print("{} ({}), {} shapes, {} x {}, {} Embree threads, {} repeats; Mrays/s\n\n{}", device.name, device.driver,
             args.shapes, args.size, args.size, args.threads, args.repeats, table.text());
}

}  // namespace
}  // namespace ballot::speed

int main(int argc, char** argv) {
  ballot::speed::Args args;
  CLI::App app("Compares Ballot with Embree on spheres, discs and capsules, in turn in one process");
  app.add_option("--shapes", args.shapes, "shapes of each scene [100000]")->check(CLI::Range(100, 100'000'000));
  app.add_option("--method", args.method, "method of Ballot [auto]");
  app.add_option("--size", args.size, "width and height in pixels [512]")->check(CLI::Range(1, 16384));
  app.add_option("--repeat", args.repeats, "interleaved repeats [9]")->check(CLI::Range(1, 10000));
  app.add_option("--threads", args.threads, "threads of Embree [number of cores]; LP_NUM_THREADS sets lavapipe's")
      ->check(CLI::Range(1, 1024));
  app.add_option("--device", args.device, "device of Ballot [cpu]");
  return ballot::speed::run_program(app, argc, argv, "ballot_embree_shapes", [&] { ballot::speed::run(args); });
}
