// Scenes of files that keep their meshes once: they answer as those of copies do.
#include <cmath>
#include <filesystem>

#include "api.h"

namespace {

ballot::Scene dance_with(const ballot::Device& device, const std::string& instances) {
  const auto file = std::filesystem::path(BALLOT_SOURCE_DIR) / "scenes" / "dance.gltf";
  return ballot::Scene::load(device, file.string(), {.instances = instances});
}

void expect_near(const std::vector<float>& a, const std::vector<float>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) ASSERT_NEAR(a[i], b[i], 1e-5f) << i;
}

TEST_F(Api, MeshesThatAreKeptOnceAnswerAsCopiesDo) {
  ballot::Scene kept = dance_with(*device_, "keep"), copied = dance_with(*device_, "copy");
  EXPECT_GT(kept.info().instances, 1u);
  EXPECT_EQ(copied.info().instances, 0u);
  EXPECT_EQ(kept.info().instance_triangles, copied.info().triangles);
  EXPECT_EQ(kept.info().triangles, copied.info().triangles);
  EXPECT_EQ(kept.info().meshes, 1u);
  for (const double seconds : {0.0, 1.5}) {
    kept.set_time(0, seconds);
    copied.set_time(0, seconds);
    expect_near(kept.triangles(), copied.triangles());
    const auto rays = kept.make_rays({.name = "view0"}, "ao", 32, 32);
    ASSERT_GT(rays.size(), 1000u);
    std::vector<ballot::Hit> a(rays.size()), b(rays.size());
    std::vector<std::uint32_t> prims(rays.size()), instances(rays.size());
    std::vector<float> normals_a(3 * rays.size()), normals_b(3 * rays.size());
    kept.trace(rays,
               {.hits = a.data(), .prims = prims.data(), .normals = normals_a.data(), .instances = instances.data()});
    copied.trace(rays, {.hits = b.data(), .normals = normals_b.data()});
    std::size_t others = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (a[i].prim != b[i].prim) {
        ++others;
        continue;
      }
      EXPECT_EQ(prims[i], a[i].prim);
      EXPECT_EQ(instances[i], a[i].prim == BALLOT_MISS ? BALLOT_MISS : 0);  // the scene is one mesh, as with copies
      for (std::size_t k = 3 * i; k < 3 * i + 3; ++k) EXPECT_NEAR(normals_a[k], normals_b[k], 1e-5f);
    }
    EXPECT_LE(others, rays.size() / 500);  // rays that pass an edge
    EXPECT_EQ(kept.render({.name = "view0"}, {.width = 16, .height = 16}).size(), 16u * 16 * 4);
  }
}

TEST_F(Api, PointsNearKeptMeshesAreThoseNearCopies) {
  std::string text;
  EXPECT_EQ(code_of([&] { dance_with(*device_, "keeep"); }, &text), Code::Argument);
  EXPECT_NE(text.find("'keeep'; there are: "), std::string::npos) << text;
  const std::vector<float> points{0, 0, 0, 1, 2, 3};
  std::vector<float> kept(2), copied(2);
  dance_with(*device_, "keep").nearest(points, {.distances = kept.data()});
  dance_with(*device_, "copy").nearest(points, {.distances = copied.data()});
  for (std::size_t i = 0; i < 2; ++i) EXPECT_NEAR(kept[i], copied[i], 1e-5f);
}

}  // namespace
