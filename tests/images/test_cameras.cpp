// Tests of perspective and orthographic cameras, from a glTF file to pixels, with every shading. Both kinds may be in
// one scene.
#include "shaders/shared/render.h"
#include "tests/cpu/gltf_builder.h"
#include "tests/images/pictures.h"

namespace ballot::test {
namespace {

/// Returns the square [-1, 1]^2 at z = 0 with two views from (0.5, 0.25, 3): the orthographic view "plan", whose
/// picture is 3 units high, and, if wanted, the perspective view "eye".
Scene two_cameras(bool perspective = true) {
  GltfBuilder b;
  b.mesh(b.vec3({-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0}));
  b.primitive()["indices"] = b.indices({0, 1, 2, 0, 2, 3});
  b.node({{"mesh", 0}});
  b.json["cameras"] = {
      {{"type", "orthographic"}, {"orthographic", {{"xmag", 1.5}, {"ymag", 1.5}, {"znear", 0.1}, {"zfar", 9}}}},
      {{"type", "perspective"}, {"perspective", {{"yfov", 0.9}, {"znear", 0.1}}}}};
  b.node({{"name", "plan"}, {"camera", 0}, {"translation", {0.5, 0.25, 3}}});
  if (perspective) b.node({{"name", "eye"}, {"camera", 1}, {"translation", {0.5, 0.25, 3}}});
  return b.load();
}

/// Checks depth and coverage of every pixel of a picture of the square.
void expect_moved_square(const Picture& p, const View& view) {
  std::size_t hits = 0;
  for (std::uint32_t y = 0; y < p.image.height; ++y)
    for (std::uint32_t x = 0; x < p.image.width; ++x) {
      const glm::dvec2 at = plane_point(view, x + 0.5, y + 0.5, p.image.width, p.image.height);
      const glm::dvec2 point = glm::dvec2(0.5, 0.25) + (view.orthographic ? at : at * 3.0);
      const double outside = std::max(std::abs(point.x), std::abs(point.y)) - 1;
      if (std::abs(outside) < 1e-5) continue;
      const double z = view.orthographic ? 3 : 3 * std::sqrt(1 + glm::dot(at, at));
      EXPECT_EQ(p.prim(x, y) != NO_HIT, outside < 0) << x << ", " << y;
      EXPECT_NEAR(p.at("Z", x, y), outside < 0 ? z : 0, 1e-5) << x << ", " << y;
      hits += outside < 0;
    }
  EXPECT_GT(hits, 100u);
  EXPECT_LT(hits, p.image.width * p.image.height);
}

TEST(Cameras, BothKindsOfAGltfFileByEveryShading) {
  DeviceScene world(two_cameras(), with_validation());
  EXPECT_TRUE(world.features().perspective && world.features().orthographic);
  for (const char* shading : {"eyelight", "normals", "heat", "ao", "whitted", "path"})
    for (const View& view : world.scene().views) {
      SCOPED_TRACE(fmt::format("{} {}", shading, view.name));
      expect_moved_square(render(world, view, {.width = 37, .height = 29, .shading = shading}), view);
    }
}

// A view that is not part of the scene, such as a window's, may use a camera kind that the scene lacks.
TEST(Cameras, AViewOfTheKindThatTheSceneLacks) {
  DeviceScene world(two_cameras(false), with_validation());
  EXPECT_FALSE(world.features().perspective);
  View view = world.scene().views[0];
  for (const bool orthographic : {true, false, true}) {
    view.orthographic = orthographic;
    for (const char* shading : {"eyelight", "ao"})
      expect_moved_square(render(world, view, {.width = 33, .height = 31, .shading = shading}), view);
    LiveOptions live;
    live.width = 33, live.height = 31;
    const LiveTimes times = world.live().add_sample(view, live);
    EXPECT_EQ(times.rays, 33u * 31u);
    for (const auto& [x, y] : {std::pair(16u, 15u), std::pair(0u, 15u), std::pair(32u, 0u)}) {
      const Picture p = render(world, view, {.width = 33, .height = 31});
      EXPECT_EQ(world.live().probe(view, live, x, y, false).hit.prim, p.prim(x, y)) << x << ", " << y;
    }
  }
  EXPECT_TRUE(world.messages().empty());
}

// Kernels for both camera kinds generate the same rays, bit for bit, as kernels for one kind.
TEST(Cameras, KernelsForBothKindsMakeTheSameRays) {
  DeviceScene world(two_cameras(), with_validation());
  for (const View& view : world.scene().views)
    for (const char* shading : {"eyelight", "normals", "ao"}) {
      RenderOptions options{.width = 24, .height = 17, .spp = 3, .shading = shading};
      const Picture own = render(world, view, options);
      options.every_feature = true;
      const Picture every = render(world, view, options);
      for (const char* name : {"Z", "A", "R"})
        EXPECT_EQ(own.image.channel(name).floats, every.image.channel(name).floats) << shading << " " << name;
      EXPECT_EQ(own.image.channel("prim").uints, every.image.channel("prim").uints) << shading;
    }
}

// Every ray kind of the benchmark can also start from the hits of an orthographic camera.
TEST(Cameras, RayKindsOfAnOrthographicView) {
  DeviceScene world(two_cameras(), with_validation());
  const View& plan = find_view(world.scene(), "plan");
  const Picture p = render(world, plan, {.width = 40, .height = 40});
  const auto& prims = p.image.channel("prim").uints;
  const std::size_t seen = std::size_t(std::ranges::count_if(prims, [](std::uint32_t prim) { return prim != NO_HIT; }));
  for (const RayKind& kind : kRayKinds) {
    const auto batch = world.make_batch(plan, kind, 40, 40, {.ao_rays = 1});
    EXPECT_EQ(batch->count(), kind.from_camera() ? 1600 : seen * kind.generators.size()) << kind.name;
    EXPECT_GT(world.frame(*batch, {}).total_ms(), 0);
    if (!kind.from_camera()) continue;
    for (const Ray& ray : batch->rays()) {
      EXPECT_EQ(ray.dir, glm::vec3(0, 0, -1));
      EXPECT_EQ(ray.origin.z, 3);
    }
  }
  EXPECT_TRUE(world.messages().empty());
}

/// Returns the square with a texture of 32 x 32 black and white checks.
Scene checks() {
  Scene scene = square_scene();
  scene.materials[0] = {.name = "checks"};
  scene.materials[0].base_texture = {.texture = 0};
  scene.textures = {{.image = 0, .nearest = true}};
  TextureImage image{.name = "checks", .width = 32, .height = 32};
  for (int i = 0; i < 32 * 32; ++i)
    for (int c = 0; c < 4; ++c) image.rgba.push_back(c == 3 || (i + i / 32) % 2 ? 255 : 0);
  scene.images.push_back(std::move(image));
  const auto uv = [](const glm::vec3& v) { return glm::vec2((v.x + 1) / 2, (1 - v.y) / 2); };
  for (const Triangle& t : scene.triangles) scene.uvs[0].push_back({uv(t[0]), uv(t[1]), uv(t[2])});
  finish_scene(scene);
  return scene;
}

// A pixel of an orthographic view has the same width at every distance of the surface. So a pixel that covers a quarter
// of a check shows that check from any distance, and a pixel that covers many checks shows their mean.
TEST(Cameras, MipMapsOfAnOrthographicViewDoNotDependOnTheDistance) {
  DeviceScene world(checks(), with_validation());
  for (const double distance : {3.0, 300.0}) {
    View view = view_from({0, 0, distance});
    view.orthographic = true;
    const Picture near = render(world, view, {.width = 64, .height = 64});
    for (std::uint32_t i = 0; i < 64 * 64; ++i) {
      const std::uint32_t x = i % 64, y = i / 64;
      EXPECT_EQ(near.at("R", x, y), (x / 2 + y / 2) % 2 ? 1 : 0) << x << ", " << y << " from distance " << distance;
    }
    const Picture far = render(world, view, {.width = 4, .height = 4});
    for (std::uint32_t i = 0; i < 16; ++i) EXPECT_NEAR(far.at("R", i % 4, i / 4), 0.5, 0.01) << distance;
  }
}

}  // namespace
}  // namespace ballot::test
