// What the host has of a mesh goes once the device has it, comes back when something reads it, and then stays.
#include "engine/scene/device_scene.h"
#include "tests/cpu/shapes.h"
#include "tests/device/fixture.h"

namespace ballot {
namespace {

using namespace harness;
using shapes::Triangles;

class LetGo : public DeviceTest {
 protected:
  /// A grid with triangles without area among the others.
  static Triangles wavy() {
    Triangles made = shapes::grid(120, 0.3f);
    for (const std::size_t i : {std::size_t(0), made.size() / 2, made.size() - 1}) made[i][2] = made[i][1];
    return made;
  }

  static std::unique_ptr<DeviceScene> world_of(const std::vector<Triangles>& meshes,
                                               const std::vector<Placement>& placements, BuilderId builder) {
    Scene scene;
    scene.name = "kept";
    scene.instances.first = {0};
    for (const Triangles& mesh : meshes) {
      scene.triangles.insert(scene.triangles.end(), mesh.begin(), mesh.end());
      scene.instances.first.push_back(scene.triangles.size());
    }
    scene.instances.placements = placements;
    finish_scene(scene);
    DeviceSceneOptions options;
    options.context = gpu_, options.use_cache = false, options.build.builder = builder;
    return std::make_unique<DeviceScene>(std::move(scene), options);
  }

  /// Returns true if the middle of each mesh is gone from the host.
  static bool is_gone(const DeviceScene& world) {
    const Scene& scene = world.scene_facts();
    for (std::size_t m = 0; m < scene.instances.meshes(); ++m)
      if (scene.triangles[scene.instances.first[m] + scene.instances.triangles_of(m) / 3] != Triangle{}) return false;
    return true;
  }

  static std::vector<Hit> hits_of(DeviceScene& world, std::span<const Ray> rays, const Query& query) {
    std::vector<Hit> hits(rays.size());
    world.trace(rays, hits, query);
    return hits;
  }

  /// Expects that the host's copy goes with the first trace, that no trace misses it, and that it is back when asked.
  /// `other` is the same scene.
  static void expect_back(DeviceScene& world, DeviceScene& other, std::span<const Ray> rays) {
    const Triangles before = world.scene_facts().triangles;
    const std::vector<Hit> expected = hits_of(world, rays, {.method = "while-while"});
    EXPECT_GT(std::ranges::count_if(expected, [](const Hit& h) { return h.prim != NO_HIT; }), 100);
    EXPECT_TRUE(is_gone(world));
    for (const Query& q : {Query{.method = "while-while", .knobs = {{"layout", "compact"}}}, Query{.method = "bvh8"},
                           Query{.method = "frontier"}, Query{.method = "bvh4"}, Query{.method = "packet"}})
      EXPECT_EQ(count_different(expected, hits_of(world, rays, q)), 0u) << q.method;
    EXPECT_TRUE(is_gone(world));
    other.scene();
    const Query exact{.method = "if-if", .numeric = "exact"};
    EXPECT_EQ(count_different(hits_of(other, rays, exact), hits_of(world, rays, exact)), 0u);
    EXPECT_TRUE(world.scene().triangles == before);
    hits_of(world, rays, {.method = "while-while", .knobs = {{"layout", "centred"}}});
    EXPECT_TRUE(world.scene_facts().triangles == before) << "it stays once somebody has asked";
  }
};

TEST_F(LetGo, FlatScenes) {
  const std::vector<Ray> rays = shapes::random_rays(3000);
  for (const BuilderId builder : {BuilderId::Best, BuilderId::Balanced, BuilderId::Device}) {
    if (builder == BuilderId::Device && !DeviceBuilder::runs_on(gpu_->info())) continue;
    SCOPED_TRACE(builder_of(builder).name);
    expect_back(*world_of({wavy()}, {}, builder), *world_of({wavy()}, {}, builder), rays);
  }
}

TEST_F(LetGo, ScenesOfInstances) {
  const Placement turned{0, {{{0, 1, 0, 3}, {-1, 0, 0, 0}, {0, 0, 1, 1}}}},
      beside{1, {{{1, 0, 0, -2}, {0, 1, 0, 0}, {0, 0, 1, 0}}}};
  const std::vector<Placement> placements{{0, {}}, turned, beside};
  const auto make = [&] { return world_of({wavy(), shapes::grid(90, 0.2f)}, placements, BuilderId::Balanced); };
  expect_back(*make(), *make(), shapes::random_rays(3000));
}

// A move needs the triangles and the tree of before.
TEST_F(LetGo, MovesBringBack) {
  const Triangles still = wavy();
  auto world = world_of({still}, {}, BuilderId::Balanced);
  const std::vector<Ray> rays = shapes::random_rays(3000);
  hits_of(*world, rays, {.method = "while-while"});
  ASSERT_TRUE(is_gone(*world));
  Triangles moved = still;
  for (Triangle& t : moved)
    for (glm::vec3& v : t) v.z *= 0.5f;
  EXPECT_TRUE(world->move(moved, UpdateMode::Refit) == still);
  EXPECT_TRUE(world->last_update().refitted);
  const std::vector<Hit> expected =
      hits_of(*world_of({moved}, {}, BuilderId::Balanced), rays, {.method = "while-while"});
  EXPECT_EQ(count_different(expected, hits_of(*world, rays, {.method = "while-while"})), 0u);
}

// The host's copy comes back from what the device has, which stays if another mesh finds no room.
TEST_F(LetGo, WhatTheDeviceHasStaysIfThereIsNoRoom) {
  Context narrow(options());
  narrow.lower_limits(8000, 250'000);
  JoinedArray array(narrow, Access::Storage, "leaves");
  const std::vector<JoinedArray::Wanted> both{{0, 100}, {1, 100}}, large{{1, 1'000'000}};
  array.make_room(2, both);
  std::vector<glm::uvec4> texels(100);
  for (std::uint32_t i = 0; i < texels.size(); ++i) texels[i] = glm::uvec4(i);
  array.upload(0, texels);
  array.set_revision(0, 7);
  EXPECT_THROW(array.make_room(2, large), Error);
  ASSERT_TRUE(array.is_current(0, 7));
  const std::vector<glm::uvec4> found = array.download(0);
  EXPECT_TRUE(std::equal(texels.begin(), texels.end(), found.begin()));
  array.make_room(2, std::span(both).subspan(1));
  EXPECT_TRUE(array.is_current(0, 7));
}

}  // namespace
}  // namespace ballot
