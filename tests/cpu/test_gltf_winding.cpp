// Nodes whose matrix has a negative determinant turn the winding (glTF 2.0, 3.7.4): closed meshes stay closed, wound
// outwards, with what their corners carry, however their triangles are loaded and moved.
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "engine/model/instances.h"
#include "engine/tree/host/topology.h"
#include "tests/cpu/animated.h"
#include "tests/cpu/shapes.h"

namespace ballot::test {
namespace {

constexpr double kVolume = 6;  // of the box
constexpr InstancePolicy kPolicies[] = {InstancePolicy::Copy, InstancePolicy::Keep};

// A picture of 2 x 2 pixels.
constexpr const char* kPicture =
    "data:image/png;base64,"
    "iVBORw0KGgoAAAANSUhEUgAAAAIAAAACCAYAAABytg0kAAAAE0lEQVR42mP4z8DwHwyBNAgwAABIyQj4xTT9BQAAAABJRU5ErkJggg==";

/// Returns a box of 1 x 2 x 3 as mesh 0, wound outwards. A corner at (x, y, z) has the texture coordinates (x, y) and
/// the colour (x, y, z); the last triangle has no normals.
AnimatedBuilder box_file() {
  AnimatedBuilder b;
  std::vector<float> at, normals, uvs;
  for (const Triangle& t : shapes::box({0, 0, 0}, {1, 2, 3}))
    for (const glm::vec3& v : t) {
      const glm::vec3 n = at.size() < 99 ? geometric_normal(t) : glm::vec3(0);
      at.insert(at.end(), {v.x, v.y, v.z});
      normals.insert(normals.end(), {n.x, n.y, n.z});
      uvs.insert(uvs.end(), {v.x, v.y});
    }
  const int positions = b.vec3(at);
  b.mesh(positions);
  b.primitive()["attributes"].update({{"NORMAL", b.vec3(normals)},
                                      {"COLOR_0", positions},
                                      {"TEXCOORD_0", b.accessor(b.view(uvs), 5126, uvs.size() / 2, "VEC2")}});
  b.json["images"] = {{{"uri", kPicture}}};
  b.json["textures"] = {{{"source", 0}}};
  b.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
  b.primitive()["material"] = 0;
  return b;
}

/// Returns the volume that triangles enclose; negative if they are wound inwards.
double volume_of(std::span<const Triangle> triangles) {
  double six = 0;
  for (const Triangle& t : triangles) six += glm::dot(glm::dvec3(t[0]), glm::cross(glm::dvec3(t[1]), glm::dvec3(t[2])));
  return six / 6;
}

/// Expects boxes of this volume in all, and that each corner has what the file gives it. In a flat scene `mesh_from`
/// leads from the world to the box.
void expect_boxes(const Scene& scene, double volume, const glm::dmat4& mesh_from = glm::dmat4(1)) {
  const UnsetVector<Triangle> world = world_triangles(scene);
  const Topology t = topology_of(world);
  EXPECT_TRUE(t.closed() && t.consistently_wound());
  EXPECT_NEAR(volume_of(world), volume, 1e-5 * volume);
  for (std::size_t i = 0; i < scene.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::vec3 v(mesh_from * glm::dvec4(scene.triangles[i][k], 1));
      EXPECT_LT(glm::length(glm::vec2(v) - scene.uvs[0][i][k]), 1e-5f) << i << " " << k;
      EXPECT_LT(glm::length(v - glm::vec3(scene.colors[i][k])), 1e-5f) << i << " " << k;
      const float along = glm::dot(scene.normals[i][k], geometric_normal(scene.triangles[i]));
      EXPECT_TRUE(scene.instanced() || along > 0.9f) << i << " " << k << " " << along;
    }
}

glm::dmat4 scaled(double x, double y, double z) { return glm::scale(glm::dmat4(1), glm::dvec3(x, y, z)); }

TEST(GltfWinding, NodesOfEverySign) {
  const std::pair<glm::dvec3, double> kScales[] = {
      {{-1, 1, 1}, 1}, {{1, -2, 1}, 2}, {{-1, -1, 1}, 1}, {{-1, -2, -1}, 2}, {{3, 1, 1}, 3}};
  for (const auto& [s, volume] : kScales) {
    AnimatedBuilder b = box_file();
    b.node({{"mesh", 0}, {"scale", {s.x, s.y, s.z}}});
    expect_boxes(b.load(), kVolume * volume, scaled(1 / s.x, 1 / s.y, 1 / s.z));
    b.node({{"mesh", 0}, {"translation", {20, 0, 0}}});
    for (const InstancePolicy policy : kPolicies)
      EXPECT_NEAR(volume_of(world_triangles(b.load({.instances = policy}))), kVolume * (volume + 1), 1e-4);
    expect_boxes(b.load({.instances = InstancePolicy::Keep}), kVolume * (volume + 1));
  }
}

TEST(GltfWinding, TwoMirrorsAboveEachOtherCancel) {
  AnimatedBuilder b = box_file();
  b.node({{"scale", {-1, 1, 1}}, {"children", {1, 2}}});
  b.node({{"mesh", 0}, {"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1}}});
  b.node({{"mesh", 0}, {"translation", {20, 0, 0}}});
  b.json["scenes"] = {{{"nodes", {0}}}};
  for (const InstancePolicy policy : kPolicies) {
    const UnsetVector<Triangle> world = world_triangles(b.load({.instances = policy}));
    EXPECT_NEAR(volume_of(std::span(world).first(12)), kVolume, 1e-5);
    EXPECT_NEAR(volume_of(std::span(world).last(12)), kVolume, 1e-4);
    EXPECT_TRUE(topology_of(world).consistently_wound());
  }
}

// Half a box that is open at x = 0, and its mirror image: one closed box.
TEST(GltfWinding, AHalfAndItsMirrorImageAreClosed) {
  AnimatedBuilder b;
  std::vector<float> at;
  for (const Triangle& t : shapes::box({0, 0, 0}, {1, 2, 3}))
    if (t[0].x + t[1].x + t[2].x > 0)
      for (const glm::vec3& v : t) at.insert(at.end(), {v.x, v.y, v.z});
  b.mesh(b.vec3(at));
  b.node({{"mesh", 0}});
  b.node({{"mesh", 0}, {"scale", {-1, 1, 1}}});
  for (const InstancePolicy policy : kPolicies) {
    const UnsetVector<Triangle> world = world_triangles(b.load({.instances = policy}));
    const Topology t = topology_of(world);
    EXPECT_TRUE(t.closed() && t.manifold() && t.consistently_wound());
    EXPECT_NEAR(volume_of(world), 2 * kVolume, 1e-5);
  }
}

TEST(GltfWinding, InstancesOfANode) {
  AnimatedBuilder b = box_file();
  const int scales = b.vec3({1, 1, 1, -1, 1, 1, 1, -1, -1, -2, -1, -1});
  const int places = b.vec3({0, 0, 0, 20, 0, 0, 40, 0, 0, 60, 0, 0});
  b.node(
      {{"mesh", 0},
       {"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", {{"SCALE", scales}, {"TRANSLATION", places}}}}}}}});
  for (const InstancePolicy policy : kPolicies) {
    const Scene scene = b.load({.instances = policy});
    EXPECT_NEAR(volume_of(world_triangles(scene)), 5 * kVolume, 1e-3);
    EXPECT_EQ(scene.triangles.size(), policy == InstancePolicy::Keep ? 24u : 48u);  // as in the file, and turned
    EXPECT_EQ(world_triangles(scene), b.load().triangles);
  }
}

/// Adds weights of 1 for joint 0 to the box, and a skin of the joint `node`.
void add_skin(AnimatedBuilder& b, int node) {
  std::vector<float> weights;
  for (int i = 0; i < 36; ++i) weights.insert(weights.end(), {1, 0, 0, 0});
  b.joints(std::vector<std::uint8_t>(36 * 4), weights);
  b.json["skins"] = {{{"joints", {node}}}};
  b.json["nodes"][0]["skin"] = 0;
}

// A skinned mesh does not follow its own node, so that node does not turn it either; its joints do.
TEST(GltfWinding, SkinsFollowTheirJoints) {
  AnimatedBuilder b = box_file();
  b.node({{"mesh", 0}, {"scale", {-1, 1, 1}}});
  b.node({{"name", "joint"}});
  add_skin(b, 1);
  expect_boxes(b.load(), kVolume);
  b.json["nodes"][0].erase("scale");
  b.json["nodes"][1]["scale"] = {1, 1, -2};
  for (int other = 0; other < 3; ++other) b.node({{"name", "without weight"}});
  b.json["skins"][0]["joints"] = {1, 2, 3, 4};
  expect_boxes(b.load(), 2 * kVolume, scaled(1, 1, -0.5));
}

TEST(GltfWinding, MorphTargetsUnderAMirror) {
  AnimatedBuilder b = box_file();
  b.primitive()["targets"] = {{{"POSITION", b.vec3(std::vector<float>(36 * 3))}}};
  b.node({{"mesh", 0}, {"scale", {-1, 1, 1}}});
  expect_boxes(b.load(), kVolume, scaled(-1, 1, 1));
}

/// Adds a clip that scales node 0 along x from 1 to -1 within a second.
void add_flip(AnimatedBuilder& b) {
  const int scales = b.vec3({1, 1, 1, -1, 1, 1});
  b.channel(0, "scale", {0, 1}, scales);
}

TEST(GltfWinding, ScalesThatPassZeroAndComeBack) {
  for (const char* what : {"whole", "morph", "skin"}) {
    SCOPED_TRACE(what);
    AnimatedBuilder b = box_file();
    if (*what == 'm') b.primitive()["targets"] = {{{"POSITION", b.vec3(std::vector<float>(36 * 3))}}};
    b.node({{"mesh", 0}});
    if (*what == 's') {
      b.node({{"name", "parent"}, {"children", {0}}});
      add_skin(b, 0);
    }
    add_flip(b);
    const Scene rest = b.load();
    Scene scene = rest;
    for (const double seconds : {0.75, 0.25, 1.0, 0.125, 0.875}) {
      const double x = 1 - 2 * seconds;
      set_pose(scene, &scene.animation->clips[0], seconds);
      expect_boxes(scene, kVolume * std::abs(x), scaled(1 / x, 1, 1));
    }
    set_pose(scene, nullptr, 0);
    EXPECT_EQ(scene.triangles, rest.triangles);
    EXPECT_EQ(scene.normals, rest.normals);
    EXPECT_EQ(scene.uvs, rest.uvs);
    EXPECT_EQ(scene.colors, rest.colors);
  }
}

// Instances that are kept change to the other mesh; those that cannot be mirrored have one.
TEST(GltfWinding, KeptInstancesThatPassZero) {
  AnimatedBuilder b = box_file();
  b.node({{"mesh", 0}});
  b.node({{"mesh", 0}, {"translation", {20, 0, 0}}});
  add_flip(b);
  Scene kept = b.load({.instances = InstancePolicy::Keep});
  ASSERT_TRUE(kept.instanced());
  EXPECT_EQ(kept.instances.meshes(), 2u);
  Scene copied = b.load({.instances = InstancePolicy::Copy});
  for (const double seconds : {0.75, 0.25, 1.0}) {
    set_pose(kept, &kept.animation->clips[0], seconds);
    set_pose(copied, &copied.animation->clips[0], seconds);
    EXPECT_EQ(world_triangles(kept), copied.triangles);
    expect_boxes(kept, kVolume * (1 + std::abs(1 - 2 * seconds)));
  }
  AnimatedBuilder grows = box_file();
  grows.node({{"scale", {-1, 1, 1}}, {"children", {1}}});
  grows.node({{"mesh", 0}});
  const int scales = grows.vec3({1, 1, 1, 3, 1, 1});
  grows.channel(1, "scale", {0, 1}, scales);
  kept = grows.load({.instances = InstancePolicy::Keep});
  EXPECT_EQ(kept.instances.meshes(), 1u);
  expect_boxes(posed(kept, 0.5), 2 * kVolume);
}

// Files hide nodes by a scale of 0. Numbers of triangles stay, and the instance is a point where the node is.
TEST(GltfWinding, KeptInstancesThatAreHidden) {
  AnimatedBuilder b = box_file();
  b.node({{"mesh", 0}, {"translation", {-20, 0, 0}}});
  b.node({{"mesh", 0}});
  const int scales = b.vec3({1, 1, 1, 0, 0, 0});
  b.channel(1, "scale", {0, 1}, scales);
  Scene kept = b.load({.instances = InstancePolicy::Keep});
  ASSERT_TRUE(kept.instanced());
  const std::size_t triangles = world_triangles(kept).size();
  set_pose(kept, &kept.animation->clips[0], 1.0);
  const UnsetVector<Triangle> hidden = world_triangles(kept);
  ASSERT_EQ(hidden.size(), triangles);
  for (std::size_t t = triangles / 2; t < triangles; ++t)
    for (const glm::vec3& v : hidden[t]) EXPECT_LT(glm::length(v), 1e-15f);
  set_pose(kept, &kept.animation->clips[0], 0.0);
  EXPECT_EQ(world_triangles(kept).size(), triangles);
}

}  // namespace
}  // namespace ballot::test
