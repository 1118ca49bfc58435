// Tests of scenes built in memory, of the shipped scene and of the shared test scenes.
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "engine/model/digest.h"
#include "gltf_builder.h"

namespace ballot::test {
namespace {

#ifndef BALLOT_SOURCE_DIR
#error BALLOT_SOURCE_DIR must be defined as the top of the source tree (tests/CMakeLists.txt)
#endif

Scene triangle_scene() {
  Scene scene;
  scene.name = "built";
  scene.triangles = {{glm::vec3{-1, 0, 0}, glm::vec3{3, 0, 0}, glm::vec3{0, 2, -5}}};
  return scene;
}

TEST(Scene, IsCompleted) {
  Scene scene = triangle_scene();
  finish_scene(scene);
  EXPECT_EQ(scene.bounds.lo, glm::vec3(-1, 0, -5));
  EXPECT_EQ(scene.bounds.hi, glm::vec3(3, 2, 0));
  EXPECT_EQ(scene.materials.size(), 1u);
  EXPECT_TRUE(scene.material_of.empty());  // one material
  ASSERT_EQ(scene.views.size(), 1u);
  EXPECT_EQ(scene.views[0].name, "view0");
}

TEST(Scene, DefaultViewFramesEveryVertex) {
  Scene scene = triangle_scene();
  finish_scene(scene);
  const View& view = scene.views[0];
  const glm::dmat4 camera_from_world = glm::inverse(view.world_from_camera);
  for (const glm::vec3& v : scene.triangles[0]) {
    const glm::dvec4 p = camera_from_world * glm::dvec4{v, 1};
    EXPECT_LT(p.z, 0);
    EXPECT_LE(std::abs(p.y), -p.z * std::tan(view.yfov / 2));
    EXPECT_LE(std::abs(p.x), -p.z * std::tan(view.yfov / 2));
  }
  EXPECT_NEAR(glm::determinant(glm::dmat3{view.world_from_camera}), 1, 1e-12);
}

TEST(Scene, WithoutTrianglesIsValid) {
  Scene scene;
  finish_scene(scene);
  EXPECT_EQ(scene.bounds.lo, glm::vec3(0));
  EXPECT_EQ(scene.views.size(), 1u);
  EXPECT_EQ(features_of(scene), SceneFeatures{.perspective = true});
}

TEST(Scene, RefusesWhatDoesNotFit) {
  Scene scene = triangle_scene();
  scene.normals.resize(2);
  expect_error(Failure::Arguments, {"'built'", "1 triangles", "2 triples of normals"}, [&] { finish_scene(scene); });
  scene = triangle_scene();
  scene.material_of = {0, 0};
  expect_error(Failure::Arguments, {"1 triangles", "2 entries in material_of"}, [&] { finish_scene(scene); });
  scene = triangle_scene();
  scene.material_of = {7};
  expect_error(Failure::Arguments, {"triangle 0", "material 7", "there are 1"}, [&] { finish_scene(scene); });
  scene = triangle_scene();
  scene.triangles[0][2].y = std::nanf("");
  expect_error(Failure::Arguments, {"triangle 0", "nan", "finite"}, [&] { finish_scene(scene); });
}

TEST(Scene, FeaturesCountMaterialsInUseOnly) {
  Scene scene = triangle_scene();
  scene.materials = {
      {.name = "used"}, {.name = "mirror", .metallic = 1, .roughness = 0}, {.name = "glass", .transmission = 1}};
  scene.materials[0].emissive = {0, 0, 2};
  finish_scene(scene);
  EXPECT_EQ(features_of(scene), (SceneFeatures{.emits = true, .perspective = true}));
  scene.material_of = {1};
  EXPECT_EQ(features_of(scene), (SceneFeatures{.reflects = true, .glossy = true, .perspective = true}));
  scene.materials[1].roughness = 0.05f;
  EXPECT_EQ(features_of(scene), (SceneFeatures{.glossy = true, .perspective = true}));
  scene.material_of = {2};
  scene.normals.resize(1);
  EXPECT_EQ(features_of(scene),
            (SceneFeatures{.shading_normals = true, .refracts = true, .glossy = true, .perspective = true}));
}

TEST(Scene, FeaturesCountKindsOfCamerasAndTheTree) {
  Scene scene = triangle_scene();
  finish_scene(scene);
  EXPECT_EQ(features_of(scene), SceneFeatures{.perspective = true});
  scene.views.push_back({.name = "plan", .orthographic = true});
  EXPECT_EQ(features_of(scene), (SceneFeatures{.perspective = true, .orthographic = true}));
  scene.views.erase(scene.views.begin());
  EXPECT_EQ(features_of(scene), SceneFeatures{.orthographic = true});
  EXPECT_EQ(features_of(scene, {.depth = 7, .largest_leaf = 3}),
            (SceneFeatures{.orthographic = true, .tree = {.depth = 7, .largest_leaf = 3}}));
}

TEST(Scene, UnknownViewIsRefusedWithTheNamesThereAre) {
  Scene scene = triangle_scene();
  scene.views = {{.name = "front"}, {.name = "top"}};
  finish_scene(scene);
  EXPECT_EQ(&find_view(scene, "top"), &scene.views[1]);
  expect_error(Failure::Arguments, {"no view 'side'", "front, top"}, [&] { find_view(scene, "side"); });
}

TEST(Scene, FormatsAreListedOnce) {
  std::string all;
  for (const SceneFormat& format : scene_formats()) all += format.extension;
  EXPECT_EQ(all, ".gltf.glb.obj.ply.stl.npy.npz");
}

TEST(ShippedScenes, CornellHasItsFeaturesAndViews) {
  const Scene scene = load_scene(std::filesystem::path(BALLOT_SOURCE_DIR) / "scenes" / "cornell.gltf");
  EXPECT_EQ(scene.name, "cornell");
  EXPECT_GT(scene.triangles.size(), 1000u);
  EXPECT_LT(scene.triangles.size(), 5000u);
  EXPECT_EQ(features_of(scene), (SceneFeatures{.shading_normals = true,
                                               .reflects = true,
                                               .refracts = true,
                                               .emits = true,
                                               .glossy = true,
                                               .perspective = true}));
  ASSERT_EQ(scene.views.size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(scene.views[i].name, "view" + std::to_string(i));
  EXPECT_TRUE(scene.notes.empty());
  for (std::size_t i = 0; i < scene.triangles.size(); ++i) {
    const auto& [a, b, c] = scene.triangles[i];
    for (const glm::vec3& n : scene.normals[i]) {
      EXPECT_NEAR(glm::length(n), 1, 1e-5);
      EXPECT_GT(glm::dot(glm::cross(b - a, c - a), n), 0) << "triangle " << i << " is turned away from its normal";
    }
  }
}

/// Returns the folder of the shared scenes: BALLOT_SCENES, else beside the source tree. Returns nothing if they are
/// missing.
std::optional<std::filesystem::path> shared_scenes() {
  const char* given = std::getenv("BALLOT_SCENES");
  const std::filesystem::path folder =
      given ? given : std::filesystem::path(BALLOT_SOURCE_DIR) / ".." / "shared" / "scenes";
  if (std::filesystem::exists(folder / "scenes.json")) return folder;
  return std::nullopt;
}

TEST(SharedScenes, HaveTheTrianglesAndViewsThatTheirListGives) {
  const auto folder = shared_scenes();
  if (!folder) {
    // A checkout alone has no shared scenes (licences, size). Where they are promised, their absence is a failure.
    const char* const why =
        "scenes.json was not found in $BALLOT_SCENES, nor in ../shared/scenes beside the source tree";
    if (std::getenv("CI") || std::getenv("BALLOT_SCENES")) FAIL() << why;
    GTEST_SKIP() << why;
  }
  std::ifstream stream(*folder / "scenes.json");
  const nlohmann::json list = nlohmann::json::parse(stream);
  ASSERT_FALSE(list.at("scenes").empty());
  for (const nlohmann::json& entry : list.at("scenes")) {
    const Scene scene = load_scene(*folder / entry.at("file").get<std::string>());
    SCOPED_TRACE(scene.name);
    EXPECT_EQ(scene.triangles.size(), entry.at("triangles").get<std::size_t>());
    EXPECT_EQ(scene.materials.size(), entry.at("materials").get<std::size_t>());
    EXPECT_EQ(!scene.normals.empty(), entry.at("normals").get<bool>());
    EXPECT_EQ(scene.views.size(), entry.at("views").size());
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(scene.bounds.lo[axis], entry.at("bounds")[0][axis].get<float>());
      EXPECT_EQ(scene.bounds.hi[axis], entry.at("bounds")[1][axis].get<float>());
    }
    for (const nlohmann::json& view : entry.at("views")) {
      const View& found = find_view(scene, view.at("name").get<std::string>());
      for (int axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(-found.world_from_camera[2][axis], view.at("forward")[axis].get<double>(), 1e-5);
    }
  }
}

// Checkpoints are checked against the digest of the scene, so every field must change it.
TEST(Digest, ChangesWithEveryField) {
  Scene scene = triangle_scene();
  finish_scene(scene);
  scene.textures.push_back({});
  scene.images.push_back({.width = 1, .height = 1, .rgba = {1, 2, 3, 4}});
  scene.uvs[0].push_back({});
  scene.lights.push_back({});
  const std::function<void(Scene&)> changes[] = {
      [](Scene& s) { s.triangles[0][2].z = -4; },
      [](Scene& s) { s.normals.push_back({}); },
      [](Scene& s) { s.material_of = {1}; },
      [](Scene& s) { s.materials[0].base_color.g = 0; },
      [](Scene& s) { s.materials[0].emissive.b = 1; },
      [](Scene& s) { s.materials[0].metallic = 1; },
      [](Scene& s) { s.materials[0].roughness = std::nextafter(1.0f, 0.0f); },
      [](Scene& s) { s.materials[0].transmission = 1; },
      [](Scene& s) { s.materials[0].ior = 1.33f; },
      [](Scene& s) { s.materials[0].alpha = 0.5f; },
      [](Scene& s) { s.materials[0].alpha_mode = Alpha::Blend; },
      [](Scene& s) { s.materials[0].alpha_cutoff = 0.25f; },
      [](Scene& s) { s.materials[0].unlit = true; },
      [](Scene& s) { s.materials[0].normal_scale = 2; },
      [](Scene& s) { s.materials[0].base_texture.texture = 0; },
      [](Scene& s) { s.materials[0].surface_texture.texture = 0; },
      [](Scene& s) { s.materials[0].emissive_texture.set = 1; },
      [](Scene& s) { s.materials[0].normal_texture.row_v.z = 1; },
      [](Scene& s) { s.textures[0].wrap_v = Wrap::Clamp; },
      [](Scene& s) { s.textures[0].nearest = true; },
      [](Scene& s) { s.images[0].srgb = true; },
      [](Scene& s) { s.images[0].rgba[3] = 5; },
      [](Scene& s) { s.uvs[0][0][1].x = 1; },
      [](Scene& s) { std::swap(s.uvs[0], s.uvs[1]); },
      [](Scene& s) { s.lights[0].kind = Light::Kind::Spot; },
      [](Scene& s) { s.lights[0].position.x = 1; },
      [](Scene& s) { s.lights[0].intensity.x = 2; },
      [](Scene& s) { s.lights[0].range = 3; },
      [](Scene& s) { s.lights[0].outer_angle = 0.5f; },
      [](Scene& s) { s.sky.kind = Sky::Kind::Constant; },
      [](Scene& s) { s.sky.map.push_back({}); },
  };
  std::set<std::uint64_t> seen{digest_of(scene)};
  for (const auto& change : changes) {
    Scene changed = scene;
    change(changed);
    seen.insert(digest_of(changed));
  }
  EXPECT_EQ(seen.size(), 1 + std::size(changes));
}

}  // namespace
}  // namespace ballot::test
