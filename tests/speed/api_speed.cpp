// The library's speed as its users meet it: from arrays in memory to hits, on the device alone, and the latency of
// small batches. One line for each measurement. Wall times are medians of several runs. Device times are those of
// the last run; those of batches are added up. For host arrays that are traced in the background, 0 is printed.
//
//   ballot_api_speed scenes/cornell.gltf [--size 4096] [--device gpu] [--repeat 5]
#include <ballot/ballot.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <vector>

namespace {

double seconds(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Returns the median wall time of `repeat` runs, after one that is not counted.
double median(int repeat, const std::function<void()>& work) {
  work();
  std::vector<double> times;
  for (int i = 0; i < repeat; ++i) times.push_back(seconds(work));
  std::ranges::sort(times);
  return times[times.size() / 2];
}

void print(const char* what, std::size_t rays, double s, double device_ms) {
  std::printf("%-44s %10zu rays %9.3f ms %9.1f Mrays/s, device %9.3f ms\n", what, rays, s * 1e3,
              double(rays) / s * 1e-6, device_ms);
  std::fflush(stdout);
}

struct Bench {
  const ballot::Device& device;
  const ballot::Scene& scene;
  int repeat;

  void host(const char* what, const std::vector<ballot::Ray>& rays) const {
    std::vector<ballot::Hit> hits(rays.size());
    ballot::Times times;
    const double s = median(repeat, [&] { times = scene.trace(rays, hits); });
    print(what, rays.size(), s, times.device_ms);
  }

  void arrays(const char* what, const std::vector<ballot::Ray>& rays, std::size_t count) const {
    ballot::Array<ballot::Ray> in(device, count);
    ballot::Array<ballot::Hit> out(device, count);
    in.write(std::span(rays).first(count));
    const ballot::Query query{.ray_class = "primary"};
    ballot::Times times;
    const double s = median(4 * repeat, [&] { times = scene.trace(in, out, count, query); });
    print(what, count, s, times.device_ms);
  }

  /// Batches that follow each other, as a renderer or a simulation sends them.
  void batches(const std::vector<ballot::Ray>& rays, std::size_t count) const {
    constexpr int kBatches = 256;
    ballot::Array<ballot::Ray> in(device, count);
    ballot::Array<ballot::Hit> out(device, count);
    in.write(std::span(rays).first(count));
    const ballot::Query query{.ray_class = "primary"};
    double device_ms = 0;
    const double s = median(repeat, [&] {
      std::vector<ballot::Job> jobs;
      for (int i = 0; i < kBatches; ++i) jobs.push_back(scene.submit(in, out, count, query));
      device_ms = 0;
      for (ballot::Job& job : jobs) device_ms += job.wait().device_ms;
    });
    print("arrays on the device, 256 batches", kBatches * count, s, device_ms);
  }

  void background(const std::vector<ballot::Ray>& rays) const {
    std::vector<ballot::Hit> hits(rays.size());
    const double s = median(repeat, [&] { scene.submit(rays, {.hits = hits.data()}).wait(); });
    print("host arrays, in the background", rays.size(), s, 0);
  }

  void results(const std::vector<ballot::Ray>& rays) const {
    std::vector<float> t(rays.size()), normals(3 * rays.size());
    std::vector<std::uint32_t> prims(rays.size()), ids(rays.size());
    ballot::Times times;
    const double s = median(repeat, [&] {
      times =
          scene.trace(rays, {.t = t.data(), .prims = prims.data(), .mesh_ids = ids.data(), .normals = normals.data()});
    });
    print("host arrays: t, ids, prims, normals", rays.size(), s, times.device_ms);
  }
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("The library's speed as its users meet it");
  std::string file, device_name;
  std::uint32_t size = 1024;
  int repeat = 5;
  app.add_option("scene", file, "a scene file")->required();
  app.add_option("--device", device_name, "as ballot --device");
  app.add_option("--size", size, "width and height of the primary rays' picture, in pixels");
  app.add_option("--repeat", repeat,
                 "runs of each measurement; four times as many for a batch of arrays on the device");
  CLI11_PARSE(app, argc, argv);
  try {
    const ballot::Device device(device_name);
    std::printf("%s, %s; wall times are medians of %d runs, of %d for a batch on the device\n", device.info().name,
                device.info().driver, repeat, 4 * repeat);
    const ballot::Scene scene = ballot::Scene::load(device, file);
    const std::vector<ballot::Ray> rays = scene.make_rays({}, "primary", size, size);
    const Bench bench{device, scene, repeat};
    for (const std::size_t few : {1, 1000}) bench.host("latency, host arrays", {rays.begin(), rays.begin() + few});
    for (const std::size_t few : {1, 1000}) bench.arrays("latency, arrays on the device", rays, few);
    bench.host("host arrays", {rays.begin(), rays.begin() + std::min<std::ptrdiff_t>(1000000, std::ssize(rays))});
    bench.host("host arrays", rays);
    bench.results(rays);
    bench.background(rays);
    bench.arrays("arrays on the device", rays, std::min<std::size_t>(1000000, rays.size()));
    bench.arrays("arrays on the device", rays, rays.size());
    bench.batches(rays, std::min<std::size_t>(1000000, rays.size()));
  } catch (const ballot::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return int(error.code());
  }
  return 0;
}
