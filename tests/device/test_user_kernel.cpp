// Holds what kernels of users are answered to the answers of the built-in kernels, bit for bit.
#include "tests/device/forests.h"
#include "tests/device/scene_cases.h"
#include "tests/device/user_kernels.h"

namespace ballot {
namespace {

using namespace scene_cases;

constexpr const char* kEverything = R"(
readonly buffer Rays { Ray rays[]; };
readonly buffer Points { vec4 points[]; };
buffer Hits { Hit hits[]; };
buffer Occluded { uint occluded[]; };
buffer Counts { uint counts[]; };
buffer Near { Nearest near[]; };
void main(uint index) {
  if (index < rays.length()) {
    Ray ray = rays[index];
    hits[index] = nearest(ray);
    occluded[index] = uint(any(ray));
    counts[index] = count(ray);
  }
  if (index < points.length()) near[index] = closest(points[index].xyz, points[index].w);
})";

class UserKernels : public UserKernelTest {
 protected:
  static void expect_built_in_answers(Tracer& tracer, std::span<const Ray> rays, std::span<const ProbePoint> points) {
    const Answers truth = built_in(tracer, rays, points);
    UserKernel kernel(*gpu_, tracer.tree(), {.text = kEverything});
    const auto asked = on_device(rays, "rays");
    const auto probes = on_device(points, "points");
    Buffer<Hit> hits(*gpu_, rays.size(), Access::Storage, "hits");
    Buffer<std::uint32_t> occluded(*gpu_, rays.size(), Access::Storage, "occluded"),
        counted(*gpu_, rays.size(), Access::Storage, "counts");
    Buffer<Nearest> near(*gpu_, points.size(), Access::Storage, "near");
    kernel.bind("rays", asked);
    kernel.bind("points", probes);
    kernel.bind("hits", hits);
    kernel.bind("occluded", occluded);
    kernel.bind("counts", counted);
    kernel.bind("near", near);
    kernel.run(std::uint32_t(std::max(rays.size(), points.size())));
    EXPECT_EQ(different(read(hits), truth.hits), 0u);
    EXPECT_EQ(different(read(occluded), truth.occluded), 0u);
    EXPECT_EQ(different(read(counted), truth.counts), 0u);
    EXPECT_EQ(different(read(near), truth.near), 0u);
  }
};

class UserKernelScenes : public UserKernels, public testing::WithParamInterface<SceneCase> {};

TEST_P(UserKernelScenes, HaveTheAnswersOfTheBuiltInKernels) {
  const auto t = make(*gpu_, GetParam().make(), {.split_budget = 1});
  expect_built_in_answers(*t->tracer, rays_about(t->triangles, t->bvh), probes_about(t->triangles, t->bvh.bounds));
}

INSTANTIATE_TEST_SUITE_P(Scenes, UserKernelScenes, testing::ValuesIn(kScenes),
                         [](const auto& p) { return p.param.name; });
INSTANTIATE_TEST_SUITE_P(Scaled, UserKernelScenes, testing::ValuesIn(kFarSmallLarge),
                         [](const auto& p) { return p.param.name; });

TEST_F(UserKernels, HaveTheAnswersOfTheBuiltInKernelsAmongInstances) {
  Forest forest = forests::make_forest(forests::three_meshes(), forests::twelve_instances());
  Tracer tracer(*gpu_, forest);
  const Bounds bounds = forest.top_facts().bounds;
  UnsetVector<Triangle> world;
  for (std::uint32_t i = 0; i < forest.triangle_count(); ++i) world.push_back(forest.triangle(forest.place_of(i)));
  expect_built_in_answers(tracer, forests::rays_for(forest, 3000), probes_about(world, bounds));
}

TEST_F(UserKernels, HaveTheAnswersOfTheirNumericMode) {
  const auto t = make(*gpu_, shapes::soup(3000, 0.1f));
  const std::vector<Ray> rays = rays_about(t->triangles, t->bvh);
  for (const char* numeric : {"plain", "fast"})
    for (const Want want : {Want::Nearest, Want::Any}) {
      UserText text = over_rays("Hit", want == Want::Nearest ? "nearest(rays[index])"
                                                             : "any(rays[index]) ? Hit(0, 1, 0, 0) : Hit(0, 0, 0, 0)");
      text.numeric = numeric;
      std::vector<Hit> truth(rays.size());
      t->tracer->trace(rays, truth, {.want = want, .method = "while-while", .numeric = numeric});
      if (want == Want::Any)
        for (Hit& hit : truth) hit = {0, hit.prim != NO_HIT, 0, 0};
      EXPECT_EQ(different(answers<Hit>(t->tracer->tree(), text, rays), truth), 0u) << numeric;
    }
}

TEST_F(UserKernels, CompileForWhatTheyCallAlone) {
  const auto t = make(*gpu_, shapes::soup(300, 0.4f));
  Forest forest = forests::make_forest(forests::three_meshes(), forests::twelve_instances());
  Tracer among(*gpu_, forest);
  const std::vector<Ray> rays = shapes::random_rays(500);
  std::vector<ProbePoint> points;
  for (const Ray& r : rays) points.push_back({r.origin, std::numeric_limits<float>::infinity()});
  for (Tracer* tracer : {t->tracer.get(), &among}) {
    const Answers truth = built_in(*tracer, rays, points);
    DeviceTree& tree = tracer->tree();
    EXPECT_EQ(different(answers<Hit>(tree, over_rays("Hit", "nearest(rays[index])"), rays), truth.hits), 0u);
    EXPECT_EQ(
        different(answers<std::uint32_t>(tree, over_rays("uint", "uint(any(rays[index]))"), rays), truth.occluded), 0u);
    EXPECT_EQ(different(answers<std::uint32_t>(tree, over_rays("uint", "count(rays[index])"), rays), truth.counts), 0u);
    EXPECT_EQ(different(answers<Nearest>(tree, over_rays("Nearest", "closest(rays[index].origin)"), rays), truth.near),
              0u);
    const auto three = answers<float>(tree, over_rays("float", "3.0"), rays);
    EXPECT_EQ(std::ranges::count(three, 3.f), 500);
  }
}

}  // namespace
}  // namespace ballot
