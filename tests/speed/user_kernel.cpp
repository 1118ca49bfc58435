// Measures kernels of users beside the built-in ones, on the device alone: ambient occlusion of points on the triangles
// of a scene, closest points, and nearest hits. The built-in kernels take the same rays and points from buffers, and
// write their answers to buffers; so does a kernel of one call. Figures are medians.
#include <algorithm>
#include <random>

#include "engine/answer/point_queries.h"
#include "engine/answer/tracer.h"
#include "engine/answer/user_kernel.h"
#include "engine/files/load.h"
#include "tests/speed/program.h"
#include "tools/bench/markdown.h"

namespace ballot::speed {
namespace {

constexpr std::uint64_t kRaysAtOnce = 1 << 24;

struct Args {
  std::vector<std::string> scenes, methods{"while-while", "auto"};
  std::uint32_t points = 1'000'000, rays = 64, repeats = 9;
  double reach = 0.1;
  std::string device = "gpu";
};

constexpr const char* kMakeRay = R"(
readonly buffer Positions { vec3 positions[]; };
readonly buffer Normals { vec3 normals[]; };
uniform float reach;
uniform uint rays_each;
uint hash(uint x) {
  x = (x ^ x >> 16) * 0x21F0AAADu;
  x = (x ^ x >> 15) * 0x735A2D97u;
  return x ^ x >> 15;
}
Ray make_ray(uint point, uint i) {
  uint seed = hash(point * 64u + i);
  float r = sqrt(float(seed & 0xFFFFu) / 65536.0), phi = 6.2831853 * float(seed >> 16) / 65536.0;
  vec3 n = normals[point], x = normalize(abs(n.x) > 0.5 ? vec3(-n.y, n.x, 0.0) : vec3(0.0, -n.z, n.y));
  vec3 dir = x * (r * cos(phi)) + cross(n, x) * (r * sin(phi)) + n * sqrt(1.0 - r * r);
  return Ray(positions[point] + 1e-4 * reach * n, 0.0, dir, reach);
}
)";
constexpr const char* kOcclusion = R"(
buffer Answers { float answers[]; };
void main(uint index) {
  uint open = 0u;
  for (uint i = 0u; i < rays_each; ++i) open += uint(!any(make_ray(index, i)));
  answers[index] = float(open) / float(rays_each);
}
)";
constexpr const char* kRays =
    "buffer Made { Ray made[]; };\n"
    "void main(uint index) { made[index] = make_ray(index / rays_each, index % rays_each); }";

/// Points on triangles, as many on each as its area asks for, in the order of the triangles.
struct Points {
  std::vector<glm::vec3> positions, normals;
};

Points points_on(std::span<const Triangle> triangles, std::uint32_t count) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(0, 1);
  double all = 0, before = 0;
  const auto cross = [](const Triangle& t) { return glm::cross(t[1] - t[0], t[2] - t[0]); };
  for (const Triangle& t : triangles) all += glm::length(cross(t));
  Points points;
  for (const Triangle& t : triangles) {
    before += glm::length(cross(t));
    while (points.positions.size() < count && double(points.positions.size()) * all < before * count) {
      const float u = std::sqrt(unit(random)), v = unit(random);
      points.positions.push_back(t[0] * (1 - u) + t[1] * (u * (1 - v)) + t[2] * (u * v));
      points.normals.push_back(glm::normalize(cross(t)));
    }
  }
  return points;
}

template <class T>
Buffer<T> on_device(Context& gpu, std::span<const T> data, const char* name) {
  Buffer<T> buffer(gpu, data.size(), Access::Storage, name);
  buffer.upload(data);
  return buffer;
}

template <class Run>
double median_ms(std::uint32_t repeats, const Run& run) {
  std::vector<double> ms;
  for (std::uint32_t i = 0; i <= repeats; ++i) {
    const TraceTimes times = run();
    if (i > 0) ms.push_back(times.device_ms);
  }
  return median(ms);
}

/// What is measured in one scene.
class Scene {
 public:
  Scene(Context& gpu, std::string name, UnsetVector<Triangle> triangles, const Args& args)
      : gpu_(gpu),
        args_(args),
        name_(std::move(name)),
        triangles_(std::move(triangles)),
        bvh_(build_bvh(triangles_)),
        tracer_(gpu, bvh_, triangles_, facts_of(bvh_)),
        points_(points_on(triangles_, args.points)),
        positions_(on_device<glm::vec3>(gpu, points_.positions, "positions")),
        normals_(on_device<glm::vec3>(gpu, points_.normals, "normals")) {
    const glm::vec3 size = bvh_.bounds.hi - bvh_.bounds.lo;
    reach_ = float(args.reach) * std::max({size.x, size.y, size.z});
  }

  void measure(bench::Table& table) {
    occlusion(table);
    const auto rays = std::uint32_t(std::min<std::uint64_t>(kRaysAtOnce, std::uint64_t{args_.points} * args_.rays));
    Buffer<Ray> made(gpu_, rays, Access::Storage, "rays");
    UserKernel maker = over_points(std::string(kMakeRay) + kRays);
    maker.bind("made", made);
    maker.run(rays);
    Buffer<Hit> hits(gpu_, rays, Access::Storage, "hits");
    for (const auto& [want, call] : {std::pair(Want::Any, "Hit(0.0, any(rays[index]) ? 1u : NO_HIT, 0.0, 0.0)"),
                                     std::pair(Want::Nearest, "nearest(rays[index])")}) {
      const std::string what = want == Want::Any ? "any hits" : "nearest hits";
      one_call(table, what, call, "Hit", made, hits);
      for (const std::string& method : args_.methods)
        row(table, what, method, rays, median_ms(args_.repeats, [&] {
              return tracer_.trace(made, hits, rays, {.want = want, .method = method, .rays = "incoherent"});
            }));
    }
    closest(table);
  }

 private:
  UserKernel over_points(const std::string& text) {
    UserKernel kernel(gpu_, tracer_.tree(), {.name = "speed", .text = text});
    kernel.bind("positions", positions_);
    kernel.bind("normals", normals_);
    kernel.set("reach", reach_);
    kernel.set("rays_each", args_.rays);
    return kernel;
  }

  void occlusion(bench::Table& table) {
    UserKernel kernel = over_points(std::string(kMakeRay) + kOcclusion);
    Buffer<float> open(gpu_, points_.positions.size(), Access::Storage, "open");
    kernel.bind("answers", open);
    row(table, "occlusion", "user, a point each", std::uint64_t{args_.points} * args_.rays,
        median_ms(args_.repeats, [&] { return kernel.run(args_.points); }));
    std::vector<float> all(open.size());
    open.download(std::span(all));
    double sum = 0;
    for (const float x : all) sum += double(x);
    open_ = sum / double(all.size());
  }

  template <class Question, class Answer>
  void one_call(bench::Table& table, const std::string& what, const std::string& call, const char* answer,
                const Buffer<Question>& asked, Buffer<Answer>& found) {
    const auto count = std::uint32_t(asked.size());
    UserKernel kernel(gpu_, tracer_.tree(),
                      {.text = fmt::format("readonly buffer Rays {{ {} rays[]; }};\nbuffer Found {{ {} found[]; }};\n",
                                           sizeof(Question) == sizeof(Ray) ? "Ray" : "vec4", answer) +
                               "void main(uint index) { found[index] = " + call + "; }"});
    kernel.bind("rays", asked);
    kernel.bind("found", found);
    row(table, what, "user, a call each", count, median_ms(args_.repeats, [&] { return kernel.run(count); }));
  }

  void closest(bench::Table& table) {
    std::vector<ProbePoint> probes;
    for (std::size_t i = 0; i < points_.positions.size(); ++i)
      probes.push_back({points_.positions[i] + reach_ * points_.normals[i], std::numeric_limits<float>::infinity()});
    const Buffer<ProbePoint> asked = on_device<ProbePoint>(gpu_, probes, "points");
    Buffer<Nearest> found(gpu_, probes.size(), Access::Storage, "nearest");
    one_call(table, "closest points", "closest(rays[index].xyz, rays[index].w)", "Nearest", asked, found);
    PointQueries queries(gpu_, tracer_.tree());
    row(table, "closest points", "built in", probes.size(), median_ms(args_.repeats, [&] {
          return queries.nearest({asked, probes.size()}, found);
        }));
  }

  void row(bench::Table& table, const std::string& what, const std::string& by, std::uint64_t count, double ms) {
    table.row({name_, what, by, fmt::format("{}", count), bench::figure(ms), bench::figure(double(count) / ms * 1e-3)});
  }

  Context& gpu_;
  const Args& args_;
  std::string name_;
  UnsetVector<Triangle> triangles_;
  Bvh bvh_;
  Tracer tracer_;
  Points points_;
  Buffer<glm::vec3> positions_, normals_;
  float reach_ = 0;

 public:
  double open_ = 0;
};

void run(const Args& args) {
  Context gpu(ContextOptions{.device = args.device});
  bench::Table table({"scene", "what", "by", "count", "device ms", "M/s"}, 3);
  for (const std::string& file : args.scenes) {
    ballot::Scene scene = load_scene(file);
    Scene measured(gpu, scene.name, std::move(scene.triangles), args);
    measured.measure(table);
    fmt::print("{}: {:.4f} of the rays are open\n", scene.name, measured.open_);
  }
  fmt::print("{} ({}), medians of {}\n\n{}", gpu.info().name, gpu.info().driver, args.repeats, table.text());
}

}  // namespace
}  // namespace ballot::speed

int main(int argc, char** argv) {
  ballot::speed::Args args;
  CLI::App app("Measures kernels of users beside the built-in ones");
  app.add_option("SCENE", args.scenes, "scene files, without instances")->required();
  app.add_option("--points", args.points, "points on the triangles [1000000]")->check(CLI::Range(1, 100'000'000));
  app.add_option("--rays", args.rays, "rays of each point [64]")->check(CLI::Range(1, 64));
  app.add_option("--reach", args.reach, "length of these rays, in longest sides of the scene [0.1]");
  app.add_option("--methods", args.methods, "built-in traversal methods [while-while,auto]")->delimiter(',');
  app.add_option("--repeats", args.repeats, "repeats of each measurement [9]")->check(CLI::Range(1, 100000));
  app.add_option("--device", args.device, "device [gpu]");
  return ballot::speed::run_program(app, argc, argv, "ballot_user_kernel", [&] { ballot::speed::run(args); });
}
