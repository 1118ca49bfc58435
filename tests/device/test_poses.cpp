// Poses of skins and morph targets on the device, bit for bit beside those of the host, and scenes that follow them.
#include <cmath>
#include <cstring>
#include <set>

#include "engine/scene/device_scene.h"
#include "tests/cpu/animated.h"
#include "tests/cpu/random_animation.h"
#include "tests/device/fixture.h"
#include "tests/device/ray_sets.h"

namespace ballot {
namespace {

class Poses : public DeviceTest {
 protected:
  static Scene dance() { return load_scene(std::filesystem::path(BALLOT_SOURCE_DIR) / "scenes" / "dance.gltf"); }

  static Scene dance_at(double seconds) {
    Scene scene = dance();
    set_pose(scene, &scene.animation->clips[0], seconds);
    return scene;
  }

  static DeviceSceneOptions on(std::shared_ptr<Context> gpu) {
    DeviceSceneOptions options;
    options.context = std::move(gpu);
    options.use_cache = false;
    return options;
  }
};

bool same_bits(std::span<const PosedVertex> a, std::span<const PosedVertex> b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size_bytes()) == 0;
}

TEST_F(Poses, TheDeviceHasTheBitsOfTheHost) {
  std::mt19937 random(5);
  Animation a;
  for (const test::RandomPart& part :
       {test::RandomPart{300, 5, 4, 0}, {1, 1, 4, 1}, {63, 0, 0, 3}, {1000, 40, 8, 2}, {129, 0, 0, 0}})
    test::add_random_part(random, part, a);
  DevicePoser poser(*gpu_, a);
  for (int pose = 0; pose < 3; ++pose) {
    const PoseInput input = test::random_input(random, a);
    std::vector<PosedVertex> here(a.posed_vertices), there(a.posed_vertices);
    pose_vertices(a, input, here);
    poser.pose(input, there);
    EXPECT_TRUE(same_bits(here, there));
  }
}

TEST_F(Poses, AnimationsWithoutVertices) { DevicePoser(*gpu_, Animation{}).pose({}, {}); }

// What is set on an engine, step by step, is what the host makes of the file, and rays hit what a new tree's do.
TEST_F(Poses, ASceneFollowsTheTime) {
  DeviceScene world(dance(), on(std::make_shared<Context>(options())));
  std::set<bool> refitted;
  for (const auto& [seconds, mode] : {std::pair(0.5, UpdateMode::Refit),
                                      {2.75, UpdateMode::Rebuild},
                                      {1.25, UpdateMode::Refit},
                                      {99.0, UpdateMode::Auto},
                                      {-3.0, UpdateMode::Auto}}) {
    SCOPED_TRACE(seconds);
    world.set_time(0, seconds, mode);
    refitted.insert(world.last_update().refitted);
    const Scene here = dance_at(seconds);
    EXPECT_EQ(world.scene().triangles, here.triangles);
    EXPECT_EQ(world.scene().normals, here.normals);
    EXPECT_EQ(world.scene().lights[0].position, here.lights[0].position);
    EXPECT_EQ(world.scene().views[1].world_from_camera, here.views[1].world_from_camera);
    EXPECT_EQ(world.scene().bounds.hi, here.bounds.hi);
    DeviceScene fresh(here, on(world.context()));
    const std::vector<Ray> rays = shapes::random_rays(2000);
    std::vector<Hit> moved(rays.size()), built(rays.size());
    world.trace(rays, moved);
    fresh.trace(rays, built);
    EXPECT_EQ(std::memcmp(moved.data(), built.data(), moved.size() * sizeof(Hit)), 0);
  }
  EXPECT_EQ(refitted.size(), 2u);
  expect_silent(*world.context());
}

// The same where the tree lies on the device: triangles are posed there, and pictures follow without them here.
TEST_F(Poses, TrianglesThatStayOnTheDevice) {
  if (!gpu_->info().float64) GTEST_SKIP() << "the device has no float64";
  DeviceSceneOptions there = on(gpu_);
  there.build.builder = BuilderId::Device;
  DeviceScene world(dance(), there);
  const RenderOptions look{.width = 48, .height = 48, .shading = "eyelight", .query = {.method = "while-while"}};
  std::set<bool> refitted;
  for (const auto& [seconds, mode] : {std::pair(0.5, UpdateMode::Refit),
                                      {2.75, UpdateMode::Rebuild},
                                      {1.25, UpdateMode::Refit},
                                      {99.0, UpdateMode::Auto}}) {
    SCOPED_TRACE(seconds);
    world.set_time(0, seconds, mode);
    refitted.insert(world.last_update().refitted);
    const Scene here = dance_at(seconds);
    EXPECT_EQ(world.scene_facts().bounds.lo, here.bounds.lo);
    EXPECT_EQ(world.scene_facts().bounds.hi, here.bounds.hi);
    const Buffer<Triangle>& moved = world.tracer().tree().built()->triangles();
    UnsetVector<Triangle> triangles(moved.size());
    moved.download(triangles);
    EXPECT_EQ(triangles, here.triangles);
    DeviceScene fresh(here, there);
    const std::vector<Ray> rays = shapes::random_rays(2000);
    std::vector<Hit> found(rays.size()), wanted(rays.size());
    world.trace(rays, found, look.query);
    fresh.trace(rays, wanted, look.query);
    EXPECT_EQ(std::memcmp(found.data(), wanted.data(), found.size() * sizeof(Hit)), 0);
    const Image a = world.render(here.views[0], look), b = fresh.render(here.views[0], look);
    for (std::size_t c = 0; c < a.channels.size(); ++c)
      for (std::size_t i = 0; i < a.channels[c].floats.size(); ++i)
        ASSERT_NEAR(a.channels[c].floats[i], b.channels[c].floats[i], 1e-5) << a.channels[c].name << " " << i;
    if (mode == UpdateMode::Rebuild) continue;  // is posed on, without having been here
    EXPECT_EQ(world.scene().triangles, here.triangles);
    EXPECT_EQ(world.scene().normals, here.normals);
  }
  EXPECT_EQ(refitted.size(), 2u);
  world.move(dance().triangles, UpdateMode::Refit);
  world.set_time(0, 0.25);
  EXPECT_EQ(world.scene().triangles, dance_at(0.25).triangles);
}

// Parts that a clip mirrors: their corners change places, with their colours, on the device as here. One moves as a
// whole and has a corner without a normal; the other has a morph target.
TEST_F(Poses, MirroredPartsTurnTheirCorners) {
  if (!gpu_->info().float64) GTEST_SKIP() << "the device has no float64";
  test::AnimatedBuilder b = test::one_triangle();
  for (int mesh = 0; mesh < 2; ++mesh) {
    if (mesh == 1) b.mesh(b.vec3({0, 0, 1, 1, 0, 1.25f, 0, 1, 1.5f}));
    auto& attributes = b.primitive(mesh)["attributes"];
    attributes["NORMAL"] = b.vec3({0, 0, 0, 0, 0, 1, 0, 0.6f, 0.8f});
    attributes["COLOR_0"] = b.vec3({1, 0, 0, 0, 1, 0, 0, 0, 1});
  }
  b.primitive(1)["targets"] = {{{"POSITION", b.vec3({0, 0, 0, 0, 0, 1, 0, 1, 0})}}};
  b.json["meshes"][1]["weights"] = {0.5};
  b.node({{"mesh", 1}});
  const int scales = b.vec3({1, 1, 1, -1, 1, 1});
  for (const int node : {0, 1}) b.channel(node, "scale", {0, 1}, scales);
  DeviceSceneOptions there = on(gpu_);
  there.build.builder = BuilderId::Device;
  DeviceScene world(b.load(), there);
  const RenderOptions look{.width = 32, .height = 32, .shading = "albedo", .query = {.method = "while-while"}};
  for (const double seconds : {0.75, 0.25, 1.0, 0.875}) {
    SCOPED_TRACE(seconds);
    world.set_time(0, seconds);
    Scene here = b.load();
    set_pose(here, &here.animation->clips[0], seconds);
    const Buffer<Triangle>& moved = world.tracer().tree().built()->triangles();
    UnsetVector<Triangle> triangles(moved.size());
    moved.download(triangles);
    EXPECT_EQ(triangles, here.triangles);
    DeviceScene fresh(here, there);
    const Image a = world.render(here.views[0], look), wanted = fresh.render(here.views[0], look);
    for (std::size_t c = 0; c < a.channels.size(); ++c)
      for (std::size_t i = 0; i < a.channels[c].floats.size(); ++i)
        ASSERT_NEAR(a.channels[c].floats[i], wanted.channels[c].floats[i], 1e-5) << a.channels[c].name << " " << i;
    EXPECT_EQ(world.scene().normals, here.normals);
    EXPECT_EQ(world.scene().colors, here.colors);
    EXPECT_EQ(world.scene().turned, here.turned);
  }
}

TEST_F(Poses, WrongTimesLeaveTheSceneAsItWas) {
  DeviceScene world(dance(), on(std::make_shared<Context>(options())));
  const UnsetVector<Triangle> rest = world.scene().triangles;
  for (const auto& [clip, seconds] : {std::pair(std::size_t{2}, 0.0), {0u, std::nan("")}, {0u, HUGE_VAL}}) {
    try {
      world.set_time(clip, seconds);
      FAIL();
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), Failure::Arguments);
      EXPECT_NE(std::string_view(e.what()).find("expected"), std::string_view::npos) << e.what();
    }
  }
  EXPECT_EQ(world.scene().triangles, rest);
}

}  // namespace
}  // namespace ballot
