// Animations of glTF files: key frames, nodes, skins, morph targets, and the poses that they make.
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <random>

#include "animated.h"
#include "random_animation.h"

namespace ballot::test {
namespace {

using nlohmann::json;

double x_at(const Scene& scene, double seconds) { return posed(scene, seconds).triangles[0][0].x; }

void expect_near(const glm::vec3& a, const glm::vec3& b, float bound) {
  EXPECT_LE(glm::length(a - b), bound) << a.x << " " << a.y << " " << a.z << " for " << b.x << " " << b.y << " " << b.z;
}

TEST(Animation, AFileThatDoesNotMoveHasNone) { EXPECT_EQ(one_triangle().load().animation, nullptr); }

TEST(Animation, LinearKeysHoldAtBothEnds) {
  const Scene scene = moving_triangle().load();
  ASSERT_TRUE(scene.animation);
  ASSERT_EQ(scene.animation->clips.size(), 1u);
  EXPECT_EQ(scene.animation->clips[0].name, "animation0");
  EXPECT_EQ(scene.animation->clips[0].seconds, 2);
  EXPECT_EQ(scene.triangles[0][0].x, 0);  // loaded at rest
  for (const auto& [t, x] : {std::pair(-5.0, 0.0), {0.0, 0.0}, {1.0, 0.0}, {1.25, 2.5}, {2.0, 10.0}, {9.0, 10.0}})
    EXPECT_EQ(x_at(scene, t), x) << t;
  EXPECT_TRUE(scene.notes.empty());
}

TEST(Animation, StepAndCubicSpline) {
  AnimatedBuilder b = one_triangle();
  const int steps = b.vec3({1, 0, 0, 2, 0, 0, 4, 0, 0});
  b.channel(0, "translation", {0, 1, 3}, steps, "STEP");
  // In-tangent, value, out-tangent of two keys that are two seconds apart.
  const int spline = b.vec3({9, 0, 0, 0, 0, 0, 1, 0, 0, 3, 0, 0, 8, 0, 0, 9, 0, 0});
  b.channel(0, "translation", {0, 2}, spline, "CUBICSPLINE", 1);
  const Scene scene = b.load();
  for (const auto& [t, x] : {std::pair(0.0, 1.0), {0.99, 1.0}, {1.0, 2.0}, {2.99, 2.0}, {3.0, 4.0}})
    EXPECT_EQ(posed(scene, t).triangles[0][0].x, x) << t;
  // At u = 1/2: 0 / 2 + 2 * 1 / 8 + 8 / 2 - 2 * 3 / 8.
  for (const auto& [t, x] : {std::pair(0.0, 0.0), {1.0, 3.5}, {2.0, 8.0}, {5.0, 8.0}})
    EXPECT_EQ(posed(scene, t, 1).triangles[0][0].x, x) << t;
}

TEST(Animation, RotationsTurnTheShorterWayAtConstantSpeed) {
  const auto s = std::numbers::sqrt2_v<float> / 2;
  for (const float sign : {1.0f, -1.0f}) {
    AnimatedBuilder b = one_triangle();
    const int turn = b.vec4({0, 0, 0, 1, 0, 0, sign * s, sign * s});
    b.channel(0, "rotation", {0, 1}, turn);
    const Scene scene = b.load();
    for (const float t : {0.0f, 0.25f, 1.0f / 3, 0.5f, 1.0f}) {
      const float angle = t * std::numbers::pi_v<float> / 2;
      expect_near(posed(scene, t).triangles[0][1], {std::cos(angle), std::sin(angle), 0}, 1e-6f);
    }
  }
}

TEST(Animation, ChildrenCamerasAndLightsFollowTheirNode) {
  AnimatedBuilder b = moving_triangle();
  b.json["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 1}}}}};
  b.json["extensions"] = {{"KHR_lights_punctual", {{"lights", {{{"type", "point"}}}}}}};
  b.json["nodes"][0]["children"] = {1};
  b.node({{"mesh", 0}, {"camera", 0}, {"translation", {0, 0, 7}}});
  b.json["nodes"][1]["extensions"] = {{"KHR_lights_punctual", {{"light", 0}}}};
  b.node({{"camera", 0}, {"translation", {5, 0, 0}}});
  b.node({{"mesh", 0}});
  const Scene rest = b.load(), end = posed(rest, 2);
  EXPECT_EQ(end.triangles[1][0], glm::vec3(10, 0, 7));
  EXPECT_EQ(end.triangles[2], rest.triangles[2]);
  EXPECT_EQ(glm::dvec3(end.views[0].world_from_camera[3]), glm::dvec3(10, 0, 7));
  EXPECT_EQ(glm::dvec3(end.views[1].world_from_camera[3]), glm::dvec3(5, 0, 0));
  EXPECT_EQ(end.lights[0].position, glm::vec3(10, 0, 7));
  EXPECT_EQ(end.bounds.hi.x, 11);
  EXPECT_EQ(rest.animation->parts.size(), 2u);  // the third mesh stays
}

// A mesh that moves as a whole has the bits of a file where it stands there.
TEST(Animation, RigidPartsHaveTheBitsOfAStillFile) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> place(-3, 3);
  std::vector<float> positions(3 * 3 * 20), normals;
  for (float& p : positions) p = place(random);
  for (std::size_t i = 0; i < positions.size(); ++i) normals.push_back(place(random));
  AnimatedBuilder still;
  still.mesh(still.vec3(positions));
  still.primitive()["attributes"]["NORMAL"] = still.vec3(normals);
  still.node({{"children", {1}}, {"rotation", {0.1, 0.2, 0.3, 0.9}}, {"scale", {1.1, -0.7, 1.3}}});
  still.node({{"mesh", 0}, {"translation", {0.1f, 0.2f, 0.3f}}});
  AnimatedBuilder moving = still;
  const int output = moving.vec3({5, 5, 5, 0.1f, 0.2f, 0.3f});
  moving.channel(1, "translation", {0, 1}, output);
  const Scene expected = still.load(), rest = moving.load(), end = posed(rest, 1);
  EXPECT_EQ(rest.triangles, expected.triangles);
  EXPECT_EQ(end.triangles, expected.triangles);
  EXPECT_EQ(end.normals, expected.normals);
  EXPECT_NE(posed(rest, 0.5).triangles, expected.triangles);
}

TEST(Animation, InstancesOfAMovingNodeMove) {
  AnimatedBuilder b = moving_triangle();
  b.json["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
  const int places = b.vec3({0, 1, 0, 0, 2, 0});
  b.json["nodes"][0]["extensions"] = {{"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", places}}}}}};
  const Scene end = posed(b.load(), 2);
  EXPECT_EQ(end.triangles[0][0], glm::vec3(10, 1, 0));
  EXPECT_EQ(end.triangles[1][0], glm::vec3(10, 2, 0));
}

TEST(Animation, SkinsFollowTheirJoints) {
  const Scene rest = skinned_triangle().load();
  EXPECT_EQ(rest.triangles[0], (Triangle{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}}));
  const Scene end = posed(rest, 1);
  expect_near(end.triangles[0][0], {0, 4, 0}, 0);
  expect_near(end.triangles[0][1], {1, 4, 0}, 1e-6f);
  // Half of (2, 4), which the first joint says, and half of (0, 4), half a turn about (1, 0) by the second.
  expect_near(end.triangles[0][2], {1, 4, 0}, 1e-6f);
  const Scene half = posed(rest, 0.5);
  expect_near(half.triangles[0][2], {1.5f, 2.5f, 0}, 1e-6f);
}

TEST(Animation, SkinsWithoutClipsAreAtRest) {
  AnimatedBuilder b = skinned_triangle();
  b.json.erase("animations");
  b.json["nodes"][1]["translation"] = {0, 0, 3};
  const Scene scene = b.load();
  EXPECT_EQ(scene.animation, nullptr);
  EXPECT_EQ(scene.triangles[0], (Triangle{{{0, 0, 3}, {1, 0, 3}, {2, 0, 3}}}));
}

TEST(Animation, WeightsAreScaledToTheirSum) {
  AnimatedBuilder b = skinned_triangle();
  b.joints({0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 200}, {3, 0, 0, 0, 0, 0, 0, 0, 7, 7, 0, 0});
  const Scene end = posed(b.load(), 1);
  expect_near(end.triangles[0][0], {0, 4, 0}, 0);
  expect_near(end.triangles[0][1], {1, 4, 0}, 1e-6f);  // without weights: its first joint
  expect_near(end.triangles[0][2], {1, 4, 0}, 1e-6f);
}

TEST(Animation, MorphTargetsAddUp) {
  AnimatedBuilder b = one_triangle();
  const int up = b.vec3({0, 0, 1, 0, 0, 1, 0, 0, 1}), out = b.vec3({-1, 0, 0, 1, 0, 0, 0, 1, 0});
  b.primitive()["targets"] = {{{"POSITION", up}}, {{"POSITION", out}}};
  b.json["meshes"][0]["weights"] = {2, 0};
  b.node({{"mesh", 0}, {"weights", {0, 4}}});
  const int weights = b.scalars({0, 0, 1, 3});
  b.channel(0, "weights", {0, 1}, weights);
  const Scene rest = b.load();
  EXPECT_EQ(rest.triangles[0], (Triangle{{{0, 0, 2}, {1, 0, 2}, {0, 1, 2}}}));   // the weights of the mesh
  EXPECT_EQ(rest.triangles[1], (Triangle{{{-4, 0, 0}, {5, 0, 0}, {0, 5, 0}}}));  // those of the node
  const Scene half = posed(rest, 0.5);
  EXPECT_EQ(half.triangles[0], (Triangle{{{-1.5f, 0, 0.5f}, {2.5f, 0, 0.5f}, {0, 2.5f, 0.5f}}}));
  EXPECT_EQ(half.triangles[1], rest.triangles[1]);
}

// The float32 pose beside the same in double. Bounds, of numbers below 16: positions 2^-18, normals 1e-4 where the
// blended matrix is far from singular.
TEST(Animation, PosesAreNearTheExactOnes) {
  std::mt19937 random(11);
  const std::uint32_t vertices = 5000, targets = 3;
  Animation a;
  add_random_part(random, {.vertices = vertices, .joints = 7, .influences = 4, .targets = targets}, a);
  const PoseInput input = random_input(random, a);
  std::vector<PosedVertex> posed(vertices);
  pose_vertices(a, input, posed);
  int compared = 0;
  for (std::uint32_t v = 0; v < vertices; ++v) {
    glm::dvec3 p{a.vertices.positions[v]}, n{a.vertices.normals[v]};
    for (std::uint32_t k = 0; k < targets; ++k) {
      p += double{input.weights[k]} * glm::dvec3(a.vertices.deltas[k * vertices + v].position);
      n += double{input.weights[k]} * glm::dvec3(a.vertices.deltas[k * vertices + v].normal);
    }
    glm::dmat4 m{0};
    for (int i = 0; i < 4; ++i) {
      const Influence& f = a.vertices.influences[4 * v + i];
      for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 4; ++column)
          m[column][row] += double{f.weight} * input.matrices[f.joint][4 * row + column];
    }
    m[3][3] = 1;
    expect_near(posed[v].position, glm::vec3(m * glm::dvec4(p, 1)), 0x1p-18f);
    if (std::abs(glm::determinant(glm::dmat3(m))) < 0.05) continue;
    ++compared;
    expect_near(glm::normalize(posed[v].normal),
                glm::vec3(glm::normalize(glm::transpose(glm::inverse(glm::dmat3(m))) * n)), 1e-4f);
  }
  EXPECT_GT(compared, 1000);
}

TEST(Animation, ClipsAreFoundByNameAndNumber) {
  AnimatedBuilder b = moving_triangle();
  const int output = b.vec3({0, 0, 0, 1, 0, 0});
  b.channel(0, "translation", {0, 1}, output, "LINEAR", 1);
  b.channel(0, "translation", {0, 1}, output, "LINEAR", 2);
  b.json["animations"][0]["name"] = "2";
  for (const int i : {1, 2}) b.json["animations"][i]["name"] = "walk";
  const Scene scene = b.load();
  const auto find = [&](const char* name) { return find_clip(scene.animation.get(), name, "built"); };
  EXPECT_EQ(find("2"), 0u);  // the name before the number
  EXPECT_EQ(find("1"), 1u);
  EXPECT_EQ(find("walk"), 1u);
  EXPECT_EQ(find("walk_2"), 2u);
  EXPECT_EQ(scene.notes.size(), 1u);
  for (const char* name : {"3", "-1", "", "run", "1x"})
    expect_error(Failure::Arguments, {"scene 'built' has no animation '", "0 2, 1 walk, 2 walk_2"},
                 [&] { find(name); });
  expect_error(Failure::Arguments, {"scene 'still' has no animation"}, [] { find_clip(nullptr, "0", "still"); });
}

TEST(Animation, TimesAreClampedToTheClip) {
  const Scene scene = moving_triangle().load();
  const AnimationClip& clip = scene.animation->clips[0];
  EXPECT_EQ(clamped_time(clip, -1), 0);
  EXPECT_EQ(clamped_time(clip, 1.5), 1.5);
  EXPECT_EQ(clamped_time(clip, 1e30), 2);
  for (const double t : {std::nan(""), HUGE_VAL})
    expect_error(Failure::Arguments, {"animation 'animation0'", "expected a finite number"}, [&] { posed(scene, t); });
}

}  // namespace
}  // namespace ballot::test
