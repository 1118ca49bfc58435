// Scenes of files that keep their meshes once: they answer as those of copies do.
#include <cmath>
#include <filesystem>

#include "api.h"

namespace {

ballot::Scene dance_with(const ballot::Device& device, const std::string& instances) {
  const auto file = std::filesystem::path(BALLOT_SOURCE_DIR) / "scenes" / "dance.gltf";
  return ballot::Scene::load(device, file.string(), {.instances = instances});
}

/// Returns the corners of all triangles where the instances lie.
std::vector<float> world_corners(const ballot::Scene& scene) {
  const std::vector<float> own = scene.triangles();
  if (scene.info().instances == 0) return own;
  const auto meshes = scene.meshes();
  std::vector<float> all;
  for (const ballot::InstanceInfo& i : scene.instances())
    for (std::size_t v = 3 * meshes[i.mesh].first; v < 3 * (meshes[i.mesh].first + i.triangles); ++v)
      for (std::size_t row = 0; row < 3; ++row) {
        const float* m = i.transform + 4 * row;
        all.push_back(m[0] * own[3 * v] + m[1] * own[3 * v + 1] + m[2] * own[3 * v + 2] + m[3]);
      }
  return all;
}

void expect_near(const std::vector<float>& a, const std::vector<float>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) ASSERT_NEAR(a[i], b[i], 1e-5f) << i;
}

TEST_F(Api, MeshesThatAreKeptOnceAnswerAsCopiesDo) {
  ballot::Scene kept = dance_with(*device_, "keep"), copied = dance_with(*device_, "copy");
  EXPECT_GT(kept.info().instances, 1u);
  EXPECT_EQ(copied.info().trees, 0u);
  EXPECT_EQ(kept.info().instance_triangles, copied.info().triangles);
  EXPECT_LT(kept.info().triangles, copied.info().triangles);
  EXPECT_LT(kept.info().meshes, copied.info().meshes);
  EXPECT_EQ(kept.instances().size(), copied.meshes().size());
  for (const double seconds : {0.0, 1.5}) {
    kept.set_time(0, seconds);
    copied.set_time(0, seconds);
    expect_near(world_corners(kept), world_corners(copied));
    const auto rays = kept.make_rays({.name = "view0"}, "ao", 32, 32);
    ASSERT_GT(rays.size(), 1000u);
    std::vector<ballot::Hit> a(rays.size()), b(rays.size());
    std::vector<std::uint32_t> prims(rays.size()), instances(rays.size()), ids(rays.size()), same_ids(rays.size());
    std::vector<float> normals_a(3 * rays.size()), normals_b(3 * rays.size());
    kept.trace(rays, {.hits = a.data(),
                      .prims = prims.data(),
                      .mesh_ids = ids.data(),
                      .normals = normals_a.data(),
                      .instances = instances.data()});
    copied.trace(rays, {.hits = b.data(), .mesh_ids = same_ids.data(), .normals = normals_b.data()});
    const auto places = kept.instances();
    std::size_t others = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (a[i].prim != b[i].prim) {
        ++others;
        continue;
      }
      EXPECT_EQ(ids[i], same_ids[i]);
      if (a[i].prim == BALLOT_MISS) {
        EXPECT_EQ(instances[i], BALLOT_MISS);
      } else {
        EXPECT_EQ(prims[i], a[i].prim - places[instances[i]].first);
        EXPECT_LT(prims[i], places[instances[i]].triangles);
      }
      for (std::size_t k = 3 * i; k < 3 * i + 3; ++k) EXPECT_NEAR(normals_a[k], normals_b[k], 1e-5f);
    }
    EXPECT_LE(others, rays.size() / 500);  // rays that pass an edge
    EXPECT_EQ(kept.render({.name = "view0"}, {.width = 16, .height = 16}).size(), 16u * 16 * 4);
  }
}

TEST_F(Api, PointsNearKeptMeshesAreThoseNearCopies) {
  std::string text;
  EXPECT_EQ(code_of([&] { dance_with(*device_, "keeep"); }, &text), BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(text.find("'keeep'; there are: "), std::string::npos) << text;
  const std::vector<float> points{0, 0, 0, 1, 2, 3};
  std::vector<float> kept(2), copied(2);
  dance_with(*device_, "keep").nearest(points, {.distances = kept.data()});
  dance_with(*device_, "copy").nearest(points, {.distances = copied.data()});
  for (std::size_t i = 0; i < 2; ++i) EXPECT_NEAR(kept[i], copied[i], 1e-5f);
}

}  // namespace
