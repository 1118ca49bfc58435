// Meshes of glTF files that are kept once: the same scene as of moved copies.
#include <cmath>

#include "engine/core/memory.h"
#include "engine/files/gltf_keep.h"
#include "engine/model/digest.h"
#include "engine/model/instances.h"
#include "tests/cpu/animated.h"

namespace ballot {
namespace {

using namespace test;

constexpr LoadOptions kKeep{.instances = InstancePolicy::Keep}, kCopy{.instances = InstancePolicy::Copy};

/// Returns a file in which mesh 0 has two primitives with normals and is used four times: moved, mirrored, sheared and
/// in a row of three; mesh 1 is used once, between them.
GltfBuilder many_uses() {
  GltfBuilder b;
  b.json["materials"] = {{{"name", "a"}}, {{"name", "b"}}};
  b.mesh(b.vec3({0, 0, 0, 1, 0, 0, 0, 1, 0.25f}));
  b.primitive()["attributes"]["NORMAL"] = b.vec3({0, 0, 1, 0.6f, 0, 0.8f, 0, 0, 0});
  b.primitive()["material"] = 1;
  b.json["meshes"][0]["primitives"].push_back(
      {{"attributes", {{"POSITION", b.vec3({0, 0, 2, 1, 0, 2, 0, 1, 2, 0, 0, 3, 1, 0, 3, 0, 1, 3})}}},
       {"material", 0}});
  b.mesh(b.vec3({0, 0, 0, 5, 0, 0, 0, 5, 0}));
  b.node({{"mesh", 0}, {"translation", {3, 0, -2}}});
  b.node({{"mesh", 1}});
  b.node({{"mesh", 0}, {"scale", {-2, 1, 1}}, {"rotation", {0, 0.6, 0, 0.8}}});
  b.node({{"mesh", 0}, {"matrix", {1, 0.5, 0, 0, 0.25, 1, 0, 0, 0, 0.125, 3, 0, 7, 8, 9, 1}}});
  b.node({{"mesh", 0}, {"translation", {0, 10, 0}}});
  b.json["nodes"].back()["extensions"] = {
      {"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", b.vec3({1, 0, 0, 2, 0, 0, 3, 0, 0})}}}}}};
  b.json["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
  return b;
}

void expect_near(const glm::vec3& a, const glm::vec3& b, float most) {
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(a[axis], b[axis], most);
}

TEST(GltfKeep, TheSameTrianglesAsOfCopies) {
  const Scene kept = many_uses().load(kKeep), copied = many_uses().load(kCopy);
  ASSERT_TRUE(kept.instanced());
  EXPECT_FALSE(copied.instanced());
  EXPECT_EQ(kept.instances.first, (std::vector<std::size_t>{0, 3, 4, 7}));  // the last is mesh 0, turned for the mirror
  EXPECT_EQ(kept.instances.placements.size(), 7u);
  EXPECT_EQ(kept.triangles.size(), 7u);
  EXPECT_EQ(triangle_count(kept), copied.triangles.size());
  const UnsetVector<Triangle> world = world_triangles(kept);
  ASSERT_EQ(world.size(), copied.triangles.size());
  std::size_t count = 0;
  for_each_triangle(kept, [&](std::size_t, std::size_t triangle, std::uint32_t prim) {
    ++count;
    EXPECT_EQ(kept.material(triangle), copied.material(prim));
    for (std::size_t k = 0; k < 3; ++k) expect_near(world[prim][k], copied.triangles[prim][k], 1e-5f);
  });
  EXPECT_EQ(count, world.size());
  expect_near(kept.bounds.lo, copied.bounds.lo, 1e-5f);
  expect_near(kept.bounds.hi, copied.bounds.hi, 1e-5f);
  EXPECT_NE(digest_of(kept), digest_of(copied));
  EXPECT_TRUE(kept.notes.empty());
}

TEST(GltfKeep, SmallScenesAreFlatUnlessAsked) {
  EXPECT_FALSE(many_uses().load().instanced());
  EXPECT_FALSE(one_triangle().load(kKeep).instanced());  // nothing is used twice
}

/// Returns a mesh of `triangles` triangles at zero, which takes no buffer, and as many nodes as `uses`.
GltfBuilder large(int triangles, int uses) {
  GltfBuilder b;
  b.json["accessors"].push_back({{"componentType", 5126}, {"count", 3 * triangles}, {"type", "VEC3"}});
  b.mesh(0);
  for (int i = 0; i < uses; ++i) b.node({{"mesh", 0}, {"translation", {i, 0, 0}}});
  return b;
}

TEST(GltfKeep, LargeScenesAreKeptWhereCopiesCostMuch) {
  const Scene scene = large(1 << 16, 70).load();
  EXPECT_EQ(scene.instances.placements.size(), 70u);
  EXPECT_EQ(scene.triangles.size(), std::size_t{1} << 16);
  EXPECT_EQ(triangle_count(scene), std::uint64_t{70} << 16);
  EXPECT_FALSE(large(1 << 14, 60).load().instanced());
  set_memory_limit(std::uint64_t{512} << 20);  // two copies of a million triangles and their tree do not fit
  EXPECT_TRUE(large(1 << 20, 2).load().instanced());
  set_memory_limit(0);
}

TEST(GltfKeep, TheChoiceFollowsSizes) {
  const auto kept = [](UsesOfMeshes meshes, std::uint64_t triangles, bool fit, InstancePolicy policy) {
    choose_kept(meshes, triangles, fit, policy);
    std::vector<std::size_t> numbers;
    for (const auto& [number, m] : meshes) numbers.push_back(number);
    return numbers;
  };
  const UsesOfMeshes meshes{{0, {.triangles = 1000, .uses = 5000}},
                            {1, {.triangles = 4, .uses = 100000}},  // an instance takes as much memory
                            {2, {.triangles = 50, .uses = 1, .moves = true}},
                            {3, {.triangles = 50, .uses = 1}}};
  using Numbers = std::vector<std::size_t>;
  EXPECT_EQ(kept(meshes, 5'400'100, true, InstancePolicy::Auto), (Numbers{0, 2}));
  EXPECT_EQ(kept(meshes, 12'400'100, true, InstancePolicy::Auto), Numbers{});  // not half of the scene
  EXPECT_EQ(kept(meshes, 12'400'100, false, InstancePolicy::Auto), (Numbers{0, 2}));
  EXPECT_EQ(kept(meshes, 5'400'100, true, InstancePolicy::Keep), (Numbers{0, 1, 2}));
  EXPECT_EQ(kept(meshes, 5'400'100, false, InstancePolicy::Copy), Numbers{});
}

TEST(GltfKeep, MatricesThatCannotBePlacedAreCopied) {
  GltfBuilder b = one_triangle();
  b.node({{"mesh", 0}, {"translation", {0, 0, 1}}});
  b.node({{"mesh", 0}, {"scale", {1, 0, 1}}});     // singular
  b.node({{"mesh", 0}, {"scale", {1, 1e5, 1}}});   // stretches too much
  b.node({{"mesh", 0}, {"scale", {1e30, 1, 1}}});  // huge
  b.node({{"mesh", 0}, {"translation", {0, 0, 2}}});
  const Scene scene = b.load(kKeep);
  EXPECT_EQ(scene.instances.placements.size(), 6u);
  EXPECT_EQ(tree_layout(scene).placements.size(), 4u);  // three and a mesh of the three copies
  EXPECT_EQ(triangle_count(scene), 6u);
  ASSERT_EQ(scene.notes.size(), 1u);
  EXPECT_NE(scene.notes[0].find("3 instances were copied"), std::string::npos);
  const UnsetVector<Triangle> world = world_triangles(scene), copies = b.load(kCopy).triangles;
  EXPECT_EQ(world, copies);
}

TEST(GltfKeep, MeshesWithoutTrianglesAndNoInstances) {
  GltfBuilder b = one_triangle();
  b.mesh(b.vec3({0, 0, 0, 1, 0, 0}));  // no triangle
  b.node({{"mesh", 1}});
  b.node({{"mesh", 1}});
  EXPECT_EQ(b.load(kKeep).triangles.size(), 1u);
  GltfBuilder none;
  none.mesh(none.vec3({0, 0, 0, 1, 0, 0}));
  none.node({{"mesh", 0}});
  none.node({{"mesh", 0}});
  EXPECT_FALSE(none.load(kKeep).instanced());
  EXPECT_TRUE(none.load(kKeep).triangles.empty());
}

TEST(GltfKeep, NodesMoveTheirInstances) {
  AnimatedBuilder b = moving_triangle();
  b.node({{"mesh", 0}, {"translation", {0, 0, 1}}});
  const Scene scene = b.load(kKeep);
  ASSERT_TRUE(scene.instanced());
  EXPECT_TRUE(scene.animation->parts.empty());
  ASSERT_EQ(scene.animation->placements.size(), 1u);
  const Scene moved = posed(scene, 1.5);
  EXPECT_EQ(moved.triangles, scene.triangles);
  EXPECT_EQ(moved.instances.placements[0].transform.m[0][3], 5);
  EXPECT_EQ(moved.instances.placements[1].transform.m[0][3], 0);
  EXPECT_EQ(moved.bounds.hi.x, 6);
  EXPECT_EQ(world_triangles(moved), posed(b.load(kCopy), 1.5).triangles);
}

TEST(GltfKeep, DeformedMeshesAreCopied) {
  AnimatedBuilder b = skinned_triangle();
  b.mesh(b.vec3({0, 0, 0, 1, 0, 0, 0, 1, 0}));
  for (int i = 0; i < 2; ++i) b.node({{"mesh", 1}, {"translation", {0, 0, i}}});
  const Scene kept = b.load(kKeep), copied = b.load(kCopy);
  EXPECT_EQ(kept.instances.placements.size(), 3u);
  EXPECT_EQ(world_triangles(kept), copied.triangles);
  EXPECT_EQ(world_triangles(posed(kept, 0.5)), posed(copied, 0.5).triangles);
}

TEST(SceneInstances, WrongOnesAreRefused) {
  const Scene good = many_uses().load(kKeep);
  const auto refuse = [&](std::initializer_list<std::string_view> parts, const auto& change) {
    Scene scene = good;
    change(scene.instances);
    expect_error(Failure::Arguments, parts, [&] {
      finish_scene(scene);
      check_spreads(scene);
    });
  };
  refuse({"no ranges that make up its 7 triangles"}, [](SceneInstances& all) { all.first.back() = 3; });
  refuse({"no ranges"}, [](SceneInstances& all) { all.first[1] = 9; });
  refuse({"instance 2: its mesh is number 3, but there are 3 meshes"},
         [](SceneInstances& all) { all.placements[2].mesh = 3; });
  refuse({"the matrix of instance 0"}, [](SceneInstances& all) { all.placements[0].transform.m[0][0] = 0; });
  refuse({"the matrix of instance 3"}, [](SceneInstances& all) { all.placements[3].transform.m[2][3] = NAN; });
}

TEST(SceneInstances, SpreadIsOneForScalesAndInfiniteForSingularMatrices) {
  EXPECT_EQ(spread_of({}), 1);
  EXPECT_EQ(spread_of({{{-3, 0, 0, 5}, {0, 3, 0, 6}, {0, 0, 3, 7}}}), 1);
  EXPECT_DOUBLE_EQ(spread_of({{{8, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}}), 8);
  EXPECT_NEAR(spread_of({{{0.6f, -0.8f, 0, 0}, {0.8f, 0.6f, 0, 0}, {0, 0, 1, 0}}}), 1.4 * 1.4, 1e-6);
  EXPECT_TRUE(std::isinf(spread_of({{{1, 1, 0, 0}, {1, 1, 0, 0}, {0, 0, 1, 0}}})));
  EXPECT_TRUE(std::isinf(spread_of({{{0, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}}})));
}

}  // namespace
}  // namespace ballot
