// Tests of the engine's error figures: the exact hits of a batch, and the count of wrong answers of a trace against
// them.
#include "engine/core/error.h"
#include "tests/cpu/shapes.h"
#include "tests/device/fixture.h"

namespace ballot {
namespace {

Scene scene_of(UnsetVector<Triangle> triangles) {
  Scene scene;
  scene.name = "shapes";
  scene.triangles = std::move(triangles);
  finish_scene(scene);
  return scene;
}

TEST(Verify, WatertightAnswersStayWithinTheBound) {
  const UnsetVector<Triangle> triangles = shapes::sphere(3);
  DeviceScene world(scene_of(triangles), {.device = "", .validate = true, .build = {}, .use_cache = false});
  std::vector<Ray> rays = shapes::edge_rays(triangles, 2000, {0.1f, 0.2f, 0});
  for (const Ray& ray : shapes::random_rays(2000)) rays.push_back(ray);
  for (const Want want : {Want::Nearest, Want::Any}) {
    const auto batch = world.make_batch("mixed", rays, want);
    double progress = 0;
    const ExactTruth truth = world.checker().exact_truth(*batch, [&](double done) { progress = done; });
    EXPECT_EQ(progress, 1);
    EXPECT_EQ(truth.rays.size(), rays.size());
    EXPECT_EQ(truth.hits.size(), rays.size());
    EXPECT_EQ(truth.counts.rays, rays.size());
    EXPECT_GT(truth.counts.triangle_tests, rays.size());
    EXPECT_GT(truth.seconds, 0);
    const ErrorFigures f = world.checker().verify(
        *batch, truth, {.want = want, .method = "packet", .numeric = "watertight", .knobs = {}}, 3);
    EXPECT_EQ(f.rays, rays.size());
    EXPECT_EQ(f.unwritten + f.beyond_bound + f.wrong_values, 0u);
    EXPECT_EQ(f.false_misses, 0u);  // the mesh is closed, and no random ray grazes it
    EXPECT_LT(f.t_ulp.median, 2);
    EXPECT_LE(f.cases.size(), 3u);
    for (const ErrorCase& error : f.cases) EXPECT_TRUE(error.within_bound) << in_words(error);
  }
  EXPECT_EQ(world.messages(), std::vector<std::string>{});
}

TEST(Verify, TruthOfAnotherBatchIsRefused) {
  DeviceScene world(scene_of(shapes::soup(20, 0.5f)),
                    {.device = "", .validate = true, .build = {}, .use_cache = false});
  const auto batch = world.make_batch("few", shapes::random_rays(10), Want::Nearest);
  const auto other = world.make_batch("more", shapes::random_rays(11), Want::Nearest);
  EXPECT_THROW(world.checker().verify(*batch, world.checker().exact_truth(*other), {}), Error);
}

}  // namespace
}  // namespace ballot
