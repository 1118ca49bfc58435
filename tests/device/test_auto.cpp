// Tests of method auto: its table, its look at rays, and what it compares.
#include "engine/answer/auto/chooser.h"
#include "engine/answer/auto/coherence.h"
#include "engine/core/error.h"
#include "tests/cpu/shapes.h"
#include "tests/device/fixture.h"

namespace ballot {
namespace {

const Query kAny{.want = Want::Any};

/// Returns a device of the kind that discrete GPUs are.
DeviceInfo a_gpu() {
  DeviceInfo gpu;
  gpu.type = VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU;
  gpu.driver_id = VK_DRIVER_ID_NVIDIA_PROPRIETARY;
  gpu.shuffle = gpu.arithmetic = gpu.float64 = true;
  gpu.subgroup_size = gpu.min_subgroup_size = gpu.max_subgroup_size = gpu.max_group_subgroups = 32;
  gpu.max_group_invocations = gpu.max_group_size_x = 1024;
  gpu.max_group_count_x = 65535;
  return gpu;
}

class Auto : public DeviceTest {
 protected:
  static void SetUpTestSuite() { gpu_ = std::make_unique<Context>(options()); }
  static void TearDownTestSuite() { gpu_.reset(); }

  std::vector<Hit> trace(const std::vector<Ray>& rays, const Query& query) const {
    std::vector<Hit> hits(rays.size());
    scene_->tracer->trace(rays, hits, query);
    return hits;
  }

  inline static std::unique_ptr<Context> gpu_;
  std::unique_ptr<Traced> scene_ = make(*gpu_, shapes::soup(3000, 0.1f));
};

// Batches that several rows of the table are for, and a stream of several chunks.
TEST_F(Auto, FindsWhatOtherMethodsFind) {
  for (const std::size_t count : {1, 100, 5000, 300'000}) {
    const auto rays = shapes::random_rays(count);
    const auto nearest = trace(rays, {}), any = trace(rays, kAny), expected = trace(rays, {.method = "if-if"});
    EXPECT_EQ(harness::count_untouched(nearest) + harness::count_untouched(any), 0u);
    EXPECT_EQ(harness::count_different(nearest, expected), 0u);
    for (std::size_t i = 0; i < rays.size(); ++i)
      ASSERT_EQ(any[i].prim == NO_HIT, expected[i].prim == NO_HIT) << "ray " << i;
  }
  expect_silent(*gpu_);
}

// The last chunk of a long batch is short.
TEST_F(Auto, TakesOneMethodForAllChunksOfABatch) {
  Buffer<Ray> few(*gpu_, 100, Access::Storage, "rays");
  few.upload(shapes::random_rays(100));
  const Query query{.rays = "primary"};
  Tracer& tracer = *scene_->tracer;
  EXPECT_EQ(tracer.resolve(query, few, 100, 1 << 20), tracer.resolve(query, 1 << 20));
  EXPECT_EQ(tracer.resolve(query, few, 100), tracer.resolve(query, 100));
}

TEST_F(Auto, KnobsOfTheQueryDecideFirst) {
  if (gpu_->info().is_cpu()) {  // no packets of several rays in a lane are among what auto takes elsewhere
    EXPECT_EQ(scene_->tracer->resolve({.knobs = {{"fallback", "1"}}}).method, "packet-wide");
  }
  EXPECT_EQ(scene_->tracer->resolve({.knobs = {{"refetch", "0.25"}}}).knobs.at("refetch"), "0.25");
  EXPECT_THROW(scene_->tracer->resolve({.knobs = {{"vote", "any"}}}), Error);
  EXPECT_THROW(scene_->tracer->resolve({.knobs = {{"speed", "9"}}}), Error);
}

// From the first move on, the host makes no trees of other formats for auto.
TEST_F(Auto, MovingTrianglesAreTracedInPairs) {
  scene_->tracer->moved(scene_->bvh, scene_->triangles, facts_of(scene_->bvh));
  for (const char* rays : {"primary", "diffuse"})
    EXPECT_EQ(format_of(find_method(scene_->tracer->resolve({.rays = rays}).method).tree).collapsed(), false) << rays;
}

TEST(AutoTable, CpuRows) {
  DeviceInfo cpu = a_gpu();
  cpu.type = VK_PHYSICAL_DEVICE_TYPE_CPU;
  cpu.driver_id = VK_DRIVER_ID_MESA_LLVMPIPE;
  const auto taken = [&](const char* rays, std::size_t count, AutoFacts facts = {}) {
    facts.rays = count;
    const AutoChoice choice = auto_choice({.rays = rays}, cpu, facts);
    EXPECT_FALSE(choice.rival);
    return choice.chosen.name();
  };
  EXPECT_EQ(taken("primary", 1 << 20), "packet-wide fallback=0");
  EXPECT_EQ(taken("primary", 10'000), "packet-wide fallback=0 rays=4");
  EXPECT_EQ(taken("primary", 10'000, {.even = 40'000}), "packet-wide fallback=0 rays=4");
  EXPECT_EQ(taken("primary", 10'000, {.even = 60'000}), "bvh4-turns");  // each ray meets another triangle
  EXPECT_EQ(taken("primary", 1000), "bvh4-turns");
  EXPECT_EQ(taken("mixed", 10'000), "bvh4-turns");
  EXPECT_EQ(taken("diffuse", 1 << 20), "bvh4-turns");
  EXPECT_EQ(taken("shadow of diffuse", 1 << 20), "bvh4-turns");
  EXPECT_EQ(taken("diffuse", 1 << 20, {.triangles = 1'000'000}), "bvh4-turns reorder=1");
  EXPECT_EQ(taken("", 1 << 20), "bvh4-turns");
  EXPECT_EQ(taken("primary", 1 << 20, {.instances = true}), "bvh4-turns");  // packet-wide has no kernel for them
  EXPECT_EQ(taken("primary", 1 << 20, {.collapses = false}), "dynamic-fetch");
  EXPECT_EQ(auto_choice({.numeric = "exact", .rays = "primary"}, cpu).chosen.name(), "dynamic-fetch");
}

TEST(AutoTable, GpuRowsHaveRivalsInLongBatches) {
  const auto taken = [](const Query& query, std::size_t count) {
    const AutoChoice choice = auto_choice(query, a_gpu(), {.rays = count});
    return choice.chosen.name() + (choice.rival ? " or " + choice.rival->name() : "");
  };
  EXPECT_EQ(taken({.rays = "primary"}, 1 << 20), "while-while");
  EXPECT_EQ(taken({.rays = "diffuse"}, 1 << 20), "while-while or bvh8");
  EXPECT_EQ(taken({.rays = "diffuse"}, 1000), "while-while leaf_run=0");
  EXPECT_EQ(taken({.want = Want::Any, .rays = "ao"}, 1 << 20), "while-while sorted=0 or bvh8 sorted=0");
  EXPECT_EQ(taken({.knobs = {{"refetch", "0.5"}}, .rays = "diffuse"}, 1 << 20), "bvh8 refetch=0.5");
}

// Minima of integers cull no box behind an origin. Where the device takes them, rays that begin there get others.
TEST_F(Auto, RaysFromBehindTakeOtherMinima) {
  std::vector<Ray> rays = shapes::random_rays(1 << 15);
  for (const bool behind : {false, true}) {
    if (behind) rays[0].t_min = -1;
    Buffer<Ray> buffer(*gpu_, rays.size(), Access::Storage, "rays");
    buffer.upload(rays);
    for (const DeviceInfo& device : {a_gpu(), gpu_->info()}) {
      Chooser chooser(*gpu_, device, scene_->bvh, scene_->triangles,
                      [](const Buffer<Ray>&, Buffer<Hit>&, std::uint32_t, const Query&) { return 1.0; });
      const bool expected = behind && !device.is_cpu();
      const auto minima = [](const Query& q) { return q.knobs.contains("minmax") ? q.knobs.at("minmax") : ""; };
      EXPECT_EQ(minima(chooser.resolve(Query{}, buffer, rays.size())), expected ? "builtin" : "");
      Query query;
      chooser.classify(query, Questions<Ray>(rays));
      EXPECT_EQ(minima(query), expected ? "builtin" : "");
      Query given{.knobs = {{"minmax", "select"}}};
      EXPECT_EQ(minima(chooser.resolve(given, buffer, rays.size())), "select");
    }
  }
  const auto expected = trace(rays, {.method = "if-if"});
  for (const char* minima : {"builtin", "integer", "select"}) {
    const Query query{.method = "while-while", .knobs = {{"minmax", minima}}};
    EXPECT_EQ(harness::count_different(trace(rays, query), expected), 0u) << minima;
  }
}

// A GPU that traces by one method faster than by the other.
TEST_F(Auto, TheFasterOfTwoIsKept) {
  const DeviceInfo device = a_gpu();
  const auto rays = shapes::random_rays(1 << 15);
  Buffer<Ray> buffer(*gpu_, rays.size(), Access::Storage, "rays");
  buffer.upload(rays);
  for (const char* fast : {"while-while", "bvh8"}) {
    int traces = 0;
    Chooser chooser(*gpu_, device, scene_->bvh, scene_->triangles,
                    [&](const Buffer<Ray>&, Buffer<Hit>&, std::uint32_t, const Query& query) {
                      ++traces;
                      return query.method == fast ? 1.0 : 1.1;
                    });
    Query query{};
    EXPECT_EQ(chooser.resolve(query, buffer, rays.size()).method, fast);  // looks at the rays, too
    EXPECT_EQ(traces, 12);
    query.rays = "incoherent";
    EXPECT_TRUE(chooser.is_resolved(query, rays.size()));
    EXPECT_FALSE(chooser.is_resolved({.want = Want::Any, .rays = "incoherent"}, rays.size()));
    EXPECT_EQ(chooser.resolve(query, rays.size()).method, fast);
    chooser.replace(scene_->bvh, scene_->triangles);
    EXPECT_FALSE(chooser.is_resolved(query, rays.size()));
  }
}

TEST(AutoTable, EvenTrianglesCountAllOfOneSize) {
  UnsetVector<Triangle> same(100, Triangle{glm::vec3(0), glm::vec3(1, 0, 0), glm::vec3(0, 1, 0)});
  EXPECT_NEAR(even_triangles(same), 100, 1e-6);
  same.push_back({glm::vec3(0), glm::vec3(1e4f, 0, 0), glm::vec3(0, 1e4f, 0)});  // a wall
  EXPECT_NEAR(even_triangles(same), 1.02, 0.01);
  EXPECT_EQ(even_triangles({}), 0);
  const UnsetVector<Triangle> many(1 << 18, same[0]);
  EXPECT_NEAR(even_triangles(many), 1 << 18, 1);
}

TEST(AutoTable, RaysAreToldByTheirDirections) {
  std::vector<Ray> rays(640, {{0, 0, 0}, 0, {1, 2, 3}, 1e30f});
  EXPECT_EQ(ray_class_of(rays), "coherent");
  for (std::size_t i = 0; i < 640; i += 128) rays[i].dir.x = -1;
  EXPECT_EQ(ray_class_of(rays), "mixed");
  for (std::size_t i = 0; i < 640; i += 64) rays[i].dir.x = -1;
  EXPECT_EQ(ray_class_of(rays), "incoherent");
  for (std::size_t i = 0; i < 640; i += 64) rays[i].t_max = -1;  // directions of dead rays do not count
  EXPECT_EQ(ray_class_of(rays), "coherent");
  EXPECT_EQ(ray_class_of({}), "coherent");
}

}  // namespace
}  // namespace ballot
