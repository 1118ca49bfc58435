// Ballot beside Embree's single-ray call on the same rays, interleaved in one process: on CPU devices only the ratio
// counts.
//   ballot_embree_ratio SCENE [--view NAME] [--size N] [--repeat N] [--numeric MODE] [--methods a,b] [--device D]
//   [--knob N=V]
// Rays: one through each pixel's centre of an N x N picture, in Morton order. Embree: default high quality, robust, one
// call a ray, as many threads as the machine has cores. Ballot: device time of the traversal. Median, p10 and p90 over
// the repeats.
#include <embree3/rtcore.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <map>
#include <thread>

#include "engine/ballot.h"
#include "engine/core/morton.h"

namespace {

using namespace ballot;
using Clock = std::chrono::steady_clock;

std::vector<Ray> primary_rays(const View& view, std::uint32_t size) {
  const glm::dmat4& m = view.world_from_camera;
  const glm::dvec3 right(m[0]), up(m[1]), back(m[2]), eye(m[3]);
  const double h = std::tan(view.yfov / 2);
  std::vector<Ray> rays(std::size_t(size) * size);
  for (std::uint32_t i = 0; i < rays.size(); ++i) {
    const double x = 2 * (even_bits(i) + 0.5) / size - 1, y = 1 - 2 * (even_bits(i >> 1) + 0.5) / size;
    const glm::dvec3 d = glm::normalize(-back + right * (x * h) + up * (y * h));
    rays[i] = {glm::vec3(eye), 0, glm::vec3(d), 1e30f};
  }
  return rays;
}

struct EmbreeScene {
  RTCDevice device = rtcNewDevice(nullptr);
  RTCScene scene = rtcNewScene(device);

  explicit EmbreeScene(const std::vector<Triangle>& triangles) {
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
    RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    void* v = rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, triangles.size() * 3);
    auto* i = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, triangles.size()));
    std::memcpy(v, triangles.data(), triangles.size() * sizeof(Triangle));
    for (std::size_t k = 0; k < triangles.size() * 3; ++k) i[k] = unsigned(k);
    rtcCommitGeometry(g);
    rtcAttachGeometry(scene, g);
    rtcReleaseGeometry(g);
    rtcCommitScene(scene);
  }
  ~EmbreeScene() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  void trace(std::span<const Ray> rays, std::span<Hit> hits) const {
    std::atomic<std::size_t> next = 0;
    std::vector<std::thread> threads;
    for (unsigned t = 0; t < std::thread::hardware_concurrency(); ++t)
      threads.emplace_back([&] {
        for (std::size_t b; (b = next.fetch_add(4096)) < rays.size();)
          for (std::size_t i = b; i < std::min(b + 4096, rays.size()); ++i) trace_one(rays[i], hits[i]);
      });
    for (std::thread& t : threads) t.join();
  }
  void trace_one(const Ray& r, Hit& hit) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRayHit q{};
    q.ray = {r.origin.x, r.origin.y, r.origin.z, r.t_min, r.dir.x, r.dir.y, r.dir.z, 0, r.t_max, ~0u, 0, 0};
    q.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene, &context, &q);
    const bool found = q.hit.geomID != RTC_INVALID_GEOMETRY_ID;
    hit = {q.ray.tfar, found ? q.hit.primID : NO_HIT, q.hit.u, q.hit.v};
  }
};

struct Series {
  std::vector<double> ms;
  double at(double share) const {
    std::vector<double> s = ms;
    std::ranges::sort(s);
    return s[std::min(s.size() - 1, std::size_t(share * double(s.size())))];
  }
};

int run(int argc, char** argv) {
  std::map<std::string, std::string> o{{"--view", "view0"}, {"--size", "512"},           {"--repeat", "20"},
                                       {"--device", ""},    {"--numeric", "watertight"}, {"--methods", ""},
                                       {"--knob", ""}};
  for (int i = 2; i + 1 < argc; i += 2) {
    if (!o.contains(argv[i])) fail(Failure::Arguments, "unknown option {}", argv[i]);
    o[argv[i]] = argv[i + 1];
  }
  if (argc < 2) fail(Failure::Arguments, "usage: ballot_embree_ratio SCENE [--view NAME] [--size N] [--repeat N] ...");
  Engine engine(load_scene(argv[1]), {.device = o["--device"], .validate = false, .build = {}, .use_cache = true});
  const auto rays = primary_rays(find_view(engine.scene(), o["--view"]), std::uint32_t(std::stoul(o["--size"])));
  const EmbreeScene embree(engine.scene().triangles);
  std::vector<Hit> hits(rays.size());
  std::vector<std::pair<std::string, Query>> queries;
  for (const Method& m : kMethods) {
    if (m.chooses) continue;
    if (!o["--methods"].empty() &&
        ("," + o["--methods"] + ",").find("," + std::string(m.name) + ",") == std::string::npos)
      continue;
    Query q{.want = Want::Nearest, .method = std::string(m.name), .numeric = o["--numeric"], .knobs = {}};
    if (const auto eq = o["--knob"].find('='); eq != std::string::npos)
      q.knobs[o["--knob"].substr(0, eq)] = o["--knob"].substr(eq + 1);
    queries.emplace_back(m.name, q);
    engine.trace(rays, hits, q);  // compiles
  }
  std::map<std::string, Series> series;
  for (int r = 0; r < std::stoi(o["--repeat"]); ++r) {
    const auto start = Clock::now();
    embree.trace(rays, hits);
    series["embree"].ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - start).count());
    for (const auto& [name, q] : queries) series[name].ms.push_back(engine.trace(rays, hits, q).device_ms);
  }
  fmt::print("{} {} {}x{} on {} ({}), {}, {} repeats\n", engine.scene().name, o["--view"], o["--size"], o["--size"],
             engine.device().name, engine.device().driver, o["--numeric"], o["--repeat"]);
  const double embree_ms = series["embree"].at(0.5);
  for (const auto& [name, s] : series)
    fmt::print("  {:<12} {:8.2f} ms [{:.2f}, {:.2f}] {:8.2f} Mrays/s  {:.3f} of Embree\n", name, s.at(0.5), s.at(0.1),
               s.at(0.9), double(rays.size()) / s.at(0.5) * 1e-3, embree_ms / s.at(0.5));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& e) {
    fmt::print(stderr, "ballot_embree_ratio: {}\n", e.what());
    return 1;
  }
}
