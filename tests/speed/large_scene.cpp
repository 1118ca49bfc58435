// A scene that is too large for one mesh, through the library: terrains side by side, each a mesh with a tree of its
// own. Every hit is known before: rays aim at triangles and vertices of known numbers. Prints what it took, and fails
// if one hit is wrong. The next step moves one terrain, several times, and checks all again.
//
//   ballot_large_scene [--device gpu] [--triangles 200000000] [--meshes 8] [--rays 10000000] [--builder device]
#include <ballot/ballot.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <thread>
#include <vector>

namespace {

using Vector = std::array<double, 3>;

Vector plus(const Vector& a, const Vector& b, double times = 1) {
  return {a[0] + times * b[0], a[1] + times * b[1], a[2] + times * b[2]};
}
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Vector unit(const Vector& a) {
  const double length = std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
  return {a[0] / length, a[1] / length, a[2] / length};
}

/// Calls work(i) for all i < count from all cores.
template <class Work>
void in_parallel(std::size_t count, const Work& work) {
  constexpr std::size_t kChunk = 1 << 10;
  std::atomic<std::size_t> next{0};
  const auto run = [&] {
    for (std::size_t begin = next.fetch_add(kChunk); begin < count; begin = next.fetch_add(kChunk))
      for (std::size_t i = begin; i < std::min(begin + kChunk, count); ++i) work(i);
  };
  std::vector<std::jthread> threads;
  for (unsigned i = 1; i < std::max(1u, std::thread::hardware_concurrency()); ++i) threads.emplace_back(run);
  run();
}

/// A terrain of 2 side^2 triangles over [-1, 1] x [-1, 1]. Two cells meet in each vertex, six triangles around it.
struct Terrain {
  std::uint64_t side;
  double phase;

  std::uint64_t triangles() const { return 2 * side * side; }
  std::array<float, 3> vertex(std::uint64_t x, std::uint64_t z) const {
    const double u = 2.0 * double(x) / double(side) - 1, v = 2.0 * double(z) / double(side) - 1;
    const double y = 0.1 * std::sin(9 * u + 4 * v + phase) + 0.05 * std::sin(23 * v - 7 * u - phase);
    return {float(u), float(y), float(v)};
  }
  std::array<std::uint64_t, 3> corners(std::uint64_t triangle) const {
    const std::uint64_t a = triangle / 2 % side + triangle / 2 / side * (side + 1), b = a + side + 1;
    if (triangle % 2 == 0) return {a, b, a + 1};
    return {a + 1, b, b + 1};
  }
  Vector at(std::uint64_t corner) const {
    const auto v = vertex(corner % (side + 1), corner / (side + 1));
    return {v[0], v[1], v[2]};
  }
  std::vector<float> positions() const {
    std::vector<float> all(3 * (side + 1) * (side + 1));
    in_parallel((side + 1) * (side + 1), [&](std::size_t i) {
      const auto v = vertex(i % (side + 1), i / (side + 1));
      std::copy(v.begin(), v.end(), all.begin() + std::ptrdiff_t(3 * i));
    });
    return all;
  }
  std::vector<std::uint32_t> indices() const {
    std::vector<std::uint32_t> all(3 * triangles());
    in_parallel(triangles(), [&](std::size_t i) {
      const auto c = corners(i);
      for (std::size_t k = 0; k < 3; ++k) all[3 * i + k] = std::uint32_t(c[k]);
    });
    return all;
  }
};

/// Returns a number in [0, 1) for a place in a sequence (Steele, Lea and Flood, Fast splittable pseudorandom number
/// generators, OOPSLA 2014).
double random_at(std::uint64_t i) {
  i = 0x9E3779B97F4A7C15ull * (i + 1);
  i = (i ^ i >> 30) * 0xBF58476D1CE4E5B9ull;
  i = (i ^ i >> 27) * 0x94D049BB133111EBull;
  return double((i ^ i >> 31) >> 11) * 0x1p-53;
}

/// The terrains in rows of four, with gaps between them: instances of their meshes.
struct Landscape {
  std::vector<Terrain> terrains;

  static Vector place(std::size_t mesh) { return {2.25 * double(mesh % 4), 0, 2.25 * double(mesh / 4)}; }
  std::vector<float> transforms() const {
    std::vector<float> all;
    for (std::size_t m = 0; m < terrains.size(); ++m) {
      const Vector at = place(m);
      all.insert(all.end(), {1, 0, 0, float(at[0]), 0, 1, 0, float(at[1]), 0, 0, 1, float(at[2])});
    }
    return all;
  }

  /// What ray number i aims at: a point of a triangle or a vertex.
  struct Aim {
    std::size_t mesh;
    bool at_vertex;
    std::uint64_t number;
    Vector to, from;
    double distance;
  };
  Aim aim(std::uint64_t i) const {
    Aim a{};
    a.mesh = std::size_t(random_at(8 * i) * double(terrains.size()));
    const Terrain& t = terrains[a.mesh];
    a.at_vertex = i % 3 == 2 && t.side > 2;
    if (a.at_vertex) {
      const auto x = 1 + std::uint64_t(random_at(8 * i + 1) * double(t.side - 1)),
                 z = 1 + std::uint64_t(random_at(8 * i + 2) * double(t.side - 1));
      a.number = x + z * (t.side + 1);
      a.to = t.at(a.number);
    } else {
      a.number = std::uint64_t(random_at(8 * i + 1) * double(t.triangles()));
      double v = random_at(8 * i + 2), w = random_at(8 * i + 3);
      if (v + w > 1) v = 1 - v, w = 1 - w;
      v = 0.2 + 0.4 * v, w = 0.2 + 0.4 * w;
      const auto c = t.corners(a.number);
      const Vector p = t.at(c[0]), q = t.at(c[1]), r = t.at(c[2]);
      a.to = plus(plus(p, plus(q, p, -1), v), plus(r, p, -1), w);
      a.from = unit(cross(plus(q, p, -1), plus(r, p, -1)));
    }
    a.to = plus(a.to, place(a.mesh));
    if (i % 3 == 1 && !a.at_vertex) {  // askew, from near by: nothing lies in between
      const Vector tilt{random_at(8 * i + 4) - 0.5, random_at(8 * i + 5) - 0.5, random_at(8 * i + 6) - 0.5};
      a.from = unit(plus(a.from, tilt));
      a.distance = std::min(0.01, 16.0 / double(t.side));
    } else {
      a.from = {0, 1, 0};
      a.distance = 1 - a.to[1];
    }
    return a;
  }
  ballot::Ray ray(std::uint64_t i) const {
    const Aim a = aim(i);
    const Vector origin = plus(a.to, a.from, a.distance);
    return {{float(origin[0]), float(origin[1]), float(origin[2])},
            0,
            {float(-a.from[0]), float(-a.from[1]), float(-a.from[2])},
            10};
  }
  /// Returns true if a hit is the one that its ray aims at.
  bool is_right(std::uint64_t i, const ballot::Hit& hit) const {
    const Aim a = aim(i);
    const Terrain& t = terrains[a.mesh];
    if (hit.prim == ballot::kMiss || hit.prim / t.triangles() != a.mesh) return false;
    const std::uint64_t triangle = hit.prim % t.triangles();
    const auto corners = t.corners(triangle);
    const bool named = a.at_vertex ? std::ranges::count(corners, a.number) > 0 : triangle == a.number;
    const double largest = std::max(std::abs(a.to[0]), std::abs(a.to[2]));
    return named && std::abs(hit.t - a.distance) <= 1e-6 * (4 + largest);  // float32 rounds origins
  }
};

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Returns the most memory that the process has had, in GiB.
double peak_memory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return double(usage.ru_maxrss) / (1 << 20);
}

/// Traces all rays and throws unless every hit is right.
void check(const ballot::Scene& scene, const Landscape& land, std::size_t count, const ballot::Query& query) {
  std::vector<ballot::Ray> rays(count);
  std::vector<ballot::Hit> hits(count);
  in_parallel(count, [&](std::size_t i) { rays[i] = land.ray(i); });
  for (int run = 0; run < 2; ++run) {
    const auto start = std::chrono::steady_clock::now();
    const ballot::Times times = scene.trace(rays, hits, query);
    std::printf("trace, %s: %.3f s, %.1f ms on the device\n", run ? "again" : "the arrays made for it",
                seconds_since(start), times.device_ms);
  }
  std::atomic<std::uint64_t> wrong{0};
  in_parallel(count, [&](std::size_t i) {
    if (land.is_right(i, hits[i]) || wrong++ > 0) return;
    const Landscape::Aim a = land.aim(i);
    std::printf("ray %zu aims at %s %llu of mesh %zu, %.9g away, and hits triangle %u at %.9g\n", i,
                a.at_vertex ? "vertex" : "triangle", static_cast<unsigned long long>(a.number), a.mesh, a.distance,
                hits[i].prim, hits[i].t);
  });
  std::printf("%zu rays: %llu hits wrong; host memory at most %.2f GiB\n", count,
              static_cast<unsigned long long>(wrong.load()), peak_memory());
  std::fflush(stdout);
  if (wrong) throw ballot::Error(BALLOT_ERROR_WORK, "the hits are wrong");
}

struct Args {
  std::string device, builder = "device", method = "auto";
  std::uint64_t triangles = 200'000'000;
  std::size_t meshes = 8, rays = 10'000'000;
  int moves = 5;
};

ballot::Scene make(const ballot::Device& device, const Landscape& land, const Args& args) {
  auto start = std::chrono::steady_clock::now();
  std::vector<std::vector<float>> positions;
  for (const Terrain& t : land.terrains) positions.push_back(t.positions());
  const std::vector<std::uint32_t> indices = land.terrains[0].indices();
  std::vector<ballot::Mesh> meshes;
  std::vector<std::uint32_t> numbers;
  for (std::size_t m = 0; m < land.terrains.size(); ++m) {
    meshes.push_back(ballot::mesh(positions[m], indices));
    numbers.push_back(std::uint32_t(m));
  }
  std::printf("%zu meshes of %llu triangles made in %.2f s\n", meshes.size(),
              static_cast<unsigned long long>(land.terrains[0].triangles()), seconds_since(start));
  std::fflush(stdout);
  start = std::chrono::steady_clock::now();
  const std::vector<float> transforms = land.transforms();
  ballot::Scene scene(device, meshes, ballot::instances(transforms, numbers),
                      {.builder = args.builder, .updates = "refit"});
  const ballot::SceneInfo info = scene.info();
  std::printf("scene: %.2f s, of it %.2f s for the trees; %llu triangles, %llu leaves, depth %u\n",
              seconds_since(start), info.build_seconds, static_cast<unsigned long long>(info.instance_triangles),
              static_cast<unsigned long long>(info.leaves), unsigned(info.depth));
  std::fflush(stdout);
  return scene;
}

/// Moves the last terrain and traces a ray, several times.
void move(ballot::Scene& scene, Landscape& land, int moves) {
  std::vector<double> ms;
  const ballot::Ray down{{0.3f, 5, 0.4f}, 0, {0, -1, 0}, 100};
  std::vector<ballot::Hit> hit(1);
  for (int step = 0; step < moves; ++step) {
    land.terrains.back().phase += 0.2;
    const std::vector<float> positions = land.terrains.back().positions();
    const auto start = std::chrono::steady_clock::now();
    scene.set_vertices(std::uint32_t(land.terrains.size() - 1), positions);
    scene.commit();
    scene.trace({&down, 1}, hit);
    ms.push_back(1e3 * seconds_since(start));
  }
  std::ranges::sort(ms);
  std::printf("one mesh moved, from the call to the first hit: median %.2f ms, least %.2f\n", ms[ms.size() / 2], ms[0]);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("A scene that is too large for one mesh");
  Args args;
  app.add_option("--device", args.device, "as ballot --device");
  app.add_option("--builder", args.builder, "builder of the trees [device]");
  app.add_option("--method", args.method, "method of traversal [auto]");
  app.add_option("--triangles", args.triangles, "of all meshes together, about")->check(CLI::PositiveNumber);
  app.add_option("--meshes", args.meshes, "meshes, of which each is placed once")->check(CLI::PositiveNumber);
  app.add_option("--rays", args.rays, "rays whose hits are checked");
  app.add_option("--moves", args.moves, "moves of one mesh; 0: none");
  CLI11_PARSE(app, argc, argv);
  try {
    const ballot::Device device(args.device);
    std::printf("%s, %s\n", device.info().name, device.info().driver);
    const auto side = std::uint64_t(std::max(1.0, std::sqrt(double(args.triangles) / 2 / double(args.meshes))));
    Landscape land;
    for (std::size_t m = 0; m < args.meshes; ++m) land.terrains.push_back({side, double(m)});
    ballot::Scene scene = make(device, land, args);
    check(scene, land, args.rays, {.method = args.method});
    if (args.moves > 0) {
      move(scene, land, args.moves);
      check(scene, land, args.rays, {.method = args.method});
    }
  } catch (const ballot::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return int(error.code());
  }
  return 0;
}
