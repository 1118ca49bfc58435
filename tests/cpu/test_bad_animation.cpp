// Tests that broken animations, skins and morph targets are refused with one clear error, or have a defined answer.
#include <cmath>
#include <limits>

#include "animated.h"

namespace ballot::test {
namespace {

using nlohmann::json;

void refuse_animation(const AnimatedBuilder& b, std::initializer_list<std::string_view> parts) {
  expect_error(Failure::Work, {"built.glb: "}, [&] { b.load(); });
  expect_error(Failure::Work, parts, [&] { b.load(); });
}

/// A triangle that moves by key frames of these times and outputs.
AnimatedBuilder moved_by(const std::vector<float>& times, const std::vector<float>& values,
                         const std::string& interpolation = "LINEAR", const std::string& path = "translation") {
  AnimatedBuilder b = one_triangle();
  const int output = path == "rotation" ? b.vec4(values) : b.vec3(values);
  b.channel(0, path, times, output, interpolation);
  return b;
}

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();

TEST(BadAnimations, WithoutChannelsNothingMoves) {
  AnimatedBuilder b = one_triangle();
  b.json["animations"] = {{{"name", "still"}, {"channels", json::array()}, {"samplers", json::array()}}};
  const Scene scene = b.load();
  ASSERT_EQ(scene.notes.size(), 1u);
  EXPECT_NE(scene.notes[0].find("animation 0 ('still') has no channels and moves nothing"), std::string::npos);
  EXPECT_EQ(scene.animation->clips[0].seconds, 0);
  EXPECT_EQ(posed(scene, 5).triangles, scene.triangles);
}

TEST(BadAnimations, TimesOfKeyFrames) {
  const std::vector<float> two{0, 0, 0, 1, 0, 0};
  refuse_animation(moved_by({1, 1}, two), {"animation 0 channel 0 has key frame 1 at 1 s, behind 1 s"});
  refuse_animation(moved_by({1, 0.5f}, two), {"expected increasing times"});
  refuse_animation(moved_by({-1, 1}, two), {"key frame 0 at -1 s", "not below 0"});
  refuse_animation(moved_by({0, kNan}, two), {"key frame 1 at nan s", "expected a finite number"});
  refuse_animation(moved_by({0, kInfinity}, two), {"key frame 1 at inf s"});
  AnimatedBuilder b = moving_triangle();
  b.json["accessors"].back()["count"] = 0;
  refuse_animation(b, {"animation 0 channel 0"});
}

TEST(BadAnimations, OutputsThatDoNotFit) {
  refuse_animation(moved_by({0, 1}, {0, 0, 0}), {"has 2 key frames and 1 outputs; expected 2"});
  refuse_animation(moved_by({0, 1}, {0, 0, 0, 1, 0, 0}, "CUBICSPLINE"), {"2 key frames and 2 outputs; expected 6"});
  refuse_animation(moved_by({0}, {0, kNan, 0}), {"has the output nan in element 0"});
  refuse_animation(moved_by({0}, {0, 0, kInfinity}), {"has the output inf in element 0"});
  refuse_animation(moved_by({0}, {0, 0, 0, 0}, "LINEAR", "rotation"), {"rotation (0, 0, 0, 0) in key frame 0"});
  refuse_animation(moved_by({0}, {0, 0, 0}, "SMOOTH"), {"interpolation 'SMOOTH'", "LINEAR, STEP or CUBICSPLINE"});
  AnimatedBuilder b = one_triangle();
  const int wrong = b.vec4({0, 0, 0, 1});
  b.channel(0, "translation", {0}, wrong);
  refuse_animation(b, {"animation 0 channel 0 output", "expected VEC3"});
}

TEST(BadAnimations, MissingSamplersNodesAndAccessors) {
  const auto changed = [](auto change) {
    AnimatedBuilder b = moving_triangle();
    change(b.json["animations"][0]);
    return b;
  };
  refuse_animation(changed([](json& a) { a["channels"][0]["sampler"] = 4; }),
                   {"names sampler 4, but the animation has 1"});
  refuse_animation(changed([](json& a) { a["channels"][0]["sampler"] = -1; }), {"channel 0 has -1 as its sampler"});
  refuse_animation(changed([](json& a) { a["channels"][0]["target"]["node"] = 9; }),
                   {"animation 0 channel 0 names node 9, but the file has 1"});
  refuse_animation(changed([](json& a) { a["channels"][0]["target"]["path"] = "color"; }),
                   {"has the path 'color'", "translation, rotation, scale or weights"});
  refuse_animation(changed([](json& a) { a["channels"][0]["target"]["path"] = "weights"; }), {"has no morph targets"});
  for (const char* which : {"input", "output"}) {
    refuse_animation(changed([&](json& a) { a["samplers"][0][which] = 77; }), {which, "names accessor 77"});
    refuse_animation(changed([&](json& a) { a["samplers"][0].erase(which); }), {which});
  }
  AnimatedBuilder b = moving_triangle();
  b.json["nodes"][0]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  refuse_animation(b, {"animation 0 channel 0 moves node 0, which has a matrix"});
}

TEST(BadAnimations, ChannelsThatMoveNoNodeAreIgnored) {
  for (const auto& target : {json{{"path", "translation"}}, json{{"node", 0}, {"path", "pointer"}}}) {
    AnimatedBuilder b = moving_triangle();
    b.json["animations"][0]["channels"][0]["target"] = target;
    const Scene scene = b.load();
    EXPECT_TRUE(scene.animation->clips[0].channels.empty());
    EXPECT_FALSE(scene.notes.empty());
  }
}

TEST(BadAnimations, NodesInACycle) {
  AnimatedBuilder b = moving_triangle();
  b.json["nodes"][0]["children"] = {1};
  b.node({{"children", {0}}});
  refuse_animation(b, {"in a cycle of child nodes"});
}

TEST(BadAnimations, SkinsThatNameMissingJoints) {
  const auto changed = [](auto change) {
    AnimatedBuilder b = skinned_triangle();
    change(b);
    return b;
  };
  using B = AnimatedBuilder;
  refuse_animation(changed([](B& b) {
                     b.json["skins"][0]["joints"] = {1, 9};
                   }),
                   {"skin 0 names node 9, but the file has 3"});
  refuse_animation(changed([](B& b) { b.json["skins"][0]["joints"] = {1, -2}; }), {"skin 0 names node -2"});
  refuse_animation(changed([](B& b) { b.json["skins"][0]["joints"] = json::array(); }), {"skin 0 has no joints"});
  refuse_animation(changed([](B& b) { b.json["skins"][0]["joints"] = {1}; }),
                   {"mesh 0 primitive 0 vertex 1 names joint 1, but skin 0 has 1"});
  refuse_animation(changed([](B& b) {
                     b.json["skins"][0]["joints"] = {1, 2, 1};
                   }),
                   {"skin 0 has 3 joints, but 2 inverse bind matrices"});
  refuse_animation(changed([](B& b) { b.json["nodes"][0]["skin"] = 5; }), {"node 0 names skin 5, but the file has 1"});
  refuse_animation(changed([](B& b) {
                     b.json["skins"][0]["inverseBindMatrices"] = b.vec3({1, 2, 3});
                   }),
                   {"skin 0 inverseBindMatrices", "expected MAT4"});
  refuse_animation(
      changed([](B& b) { b.json["skins"][0]["inverseBindMatrices"] = b.mat4(std::vector<float>(32, kNan)); }),
      {"nan in the inverse bind matrix of joint 0"});
}

TEST(BadAnimations, JointsAndWeightsOfVertices) {
  const auto with = [](const std::vector<std::uint8_t>& joints, const std::vector<float>& weights) {
    AnimatedBuilder b = skinned_triangle();
    b.joints(joints, weights);
    return b;
  };
  const std::vector<std::uint8_t> good(12);
  refuse_animation(with({0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}),
                   {"vertex 1 names joint 2, but skin 0 has 2"});
  refuse_animation(with(good, {1, 0, 0, 0, -1, 0, 0, 0, 1, 0, 0, 0}), {"vertex 1 has the joint weight -1"});
  refuse_animation(with(good, {1, 0, 0, 0, kNan, 0, 0, 0, 1, 0, 0, 0}), {"vertex 1 has the joint weight nan"});
  refuse_animation(with(good, {1, 0, 0, 0}), {"WEIGHTS_0 has 1 elements for 3 vertices"});
  refuse_animation(with({0, 0, 0, 0}, std::vector<float>(12, 1)), {"JOINTS_0 has 1 elements for 3 vertices"});
  AnimatedBuilder b = skinned_triangle();
  b.primitive()["attributes"].erase("WEIGHTS_0");
  refuse_animation(b, {"used with a skin, but has no WEIGHTS_0"});
}

TEST(BadAnimations, MorphTargetsThatDoNotFit) {
  const auto with = [](const std::vector<float>& deltas, json weights) {
    AnimatedBuilder b = one_triangle();
    b.primitive()["targets"] = {{{"POSITION", b.vec3(deltas)}}};
    b.json["meshes"][0]["weights"] = std::move(weights);
    return b;
  };
  const std::vector<float> good(9, 1);
  EXPECT_EQ(with(good, {2}).load().triangles[0][0], glm::vec3(2));
  refuse_animation(with({1, 2, 3}, {1}), {"morph target 0 POSITION has 1 elements for 3 vertices"});
  refuse_animation(with(std::vector<float>(9, kNan), {1}), {"morph target 0 vertex 0 is not finite"});
  refuse_animation(with(good, {1, 2}), {"node 0 has 2 weights for the 1 morph targets of mesh 0"});
  AnimatedBuilder b = with(good, {1});
  b.json["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", 0}}}});
  refuse_animation(b, {"mesh 0 primitive 1 has 0 morph targets, but another has 1"});
}

// Sparse zeros make large counts out of small files.
TEST(BadAnimations, TooManyDeltasAreRefused) {
  AnimatedBuilder b = one_triangle();
  b.json["accessors"].push_back({{"componentType", 5126}, {"count", 1 << 20}, {"type", "VEC3"}});
  const int many = static_cast<int>(b.json["accessors"].size()) - 1;
  b.primitive()["attributes"]["POSITION"] = many;
  const int corners = b.indices({0, 1, 2});
  b.primitive()["indices"] = corners;
  for (int i = 0; i < 257; ++i) b.primitive()["targets"].push_back({{"POSITION", many}});
  refuse_animation(b, {"moving meshes have more than"});
}

// Poses that leave the range of float32 name the triangle and the node.
TEST(BadAnimations, PosesThatAreNotFinite) {
  const Scene scene = moved_by({0, 1}, {0, 0, 0, 3e38f, 0, 0}).load();
  EXPECT_NO_THROW(posed(scene, 1));
  AnimatedBuilder b = moved_by({0, 1}, {1, 1, 1, 3e38f, 1, 1}, "LINEAR", "scale");
  b.json["nodes"][0]["children"] = {1};
  b.node({{"mesh", 0}, {"scale", {100, 1, 1}}});
  const Scene far = b.load();
  expect_error(Failure::Work, {"the pose puts triangle 1, of node 1", "expected finite numbers"},
               [&] { posed(far, 1); });
}

}  // namespace
}  // namespace ballot::test
