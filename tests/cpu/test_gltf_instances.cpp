// The glTF extension EXT_mesh_gpu_instancing.
#include "tests/cpu/gltf_builder.h"

namespace ballot {
namespace {

using namespace test;
using nlohmann::json;

GltfBuilder with_instances(json attributes, GltfBuilder b) {
  b.json["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
  b.json["nodes"][0]["extensions"] = {{"EXT_mesh_gpu_instancing", {{"attributes", std::move(attributes)}}}};
  return b;
}

TEST(GltfInstances, TranslationRotationAndScale) {
  GltfBuilder b = one_triangle();
  b.json["nodes"][0]["translation"] = {0, 0, 10};
  const int t = b.vec3({1, 0, 0, 0, 5, 0}), s = b.vec3({1, 1, 1, 2, -3, 1});
  const int r = b.accessor(b.view(std::vector<std::int16_t>{0, 0, 0, 32767, 0, 0, 32767, 0}), 5122, 2, "VEC4");
  b.json["accessors"][r]["normalized"] = true;
  b = with_instances({{"TRANSLATION", t}, {"ROTATION", r}, {"SCALE", s}}, std::move(b));
  b.json["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
  const Scene scene = b.load();
  ASSERT_EQ(scene.triangles.size(), 2u);
  EXPECT_EQ(scene.triangles[0], (Triangle{{{1, 0, 10}, {2, 0, 10}, {1, 1, 10}}}));
  // Half a turn about z of a triangle that is twice as long along x and mirrored along y, then moved. The mirror turns
  // its corners.
  EXPECT_EQ(scene.triangles[1], (Triangle{{{0, 5, 10}, {0, 8, 10}, {-2, 5, 10}}}));
  EXPECT_TRUE(scene.notes.empty());
}

TEST(GltfInstances, ChildrenAndCamerasOfTheNodeStaySingle) {
  GltfBuilder b = one_triangle();
  b.json["nodes"][0]["children"] = {1};
  b.node({{"mesh", 0}, {"translation", {0, 0, 1}}});
  b.json["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 1}}}}};
  b.json["nodes"][0]["camera"] = 0;
  const int t = b.vec3({1, 0, 0, 2, 0, 0, 3, 0, 0});
  const Scene scene = with_instances({{"TRANSLATION", t}}, std::move(b)).load();
  EXPECT_EQ(scene.triangles.size(), 4u);
  EXPECT_EQ(scene.triangles[3][0], glm::vec3(0, 0, 1));
  EXPECT_EQ(scene.views.size(), 1u);
}

TEST(GltfInstances, OwnAttributesSayHowMany) {
  GltfBuilder b = one_triangle();
  const int own = b.vec3({0, 0, 0, 0, 0, 0});
  EXPECT_EQ(with_instances({{"_FEATURE_ID_0", own}}, std::move(b)).load().triangles.size(), 2u);
}

TEST(GltfInstances, WrongOnesAreRefused) {
  const auto refuse = [](const json& attributes, std::initializer_list<std::string_view> parts) {
    GltfBuilder b = one_triangle();
    b.vec3({1, 0, 0, 2, 0, 0});           // accessor 1
    b.vec3({1, 0, 0, 2, 0, 0, 3, 0, 0});  // accessor 2
    expect_error(Failure::Work, parts, [&] { with_instances(attributes, b).load(); });
  };
  refuse({{"TRANSLATION", 1}, {"SCALE", 2}}, {"node 0, EXT_mesh_gpu_instancing", "elements", "expected as many"});
  refuse({{"ROTATION", 1}}, {"accessor 1", "expected VEC4"});
  refuse({{"TRANSLATION", 9}}, {"EXT_mesh_gpu_instancing", "9"});
  refuse({{"TRANSLATION", "x"}}, {"attribute TRANSLATION is no number"});
  refuse(json::object(), {"it has no attribute"});
  refuse(5, {"it has no attributes"});
}

// A small file must not become a large scene unawares: an accessor without a buffer has up to 2^24 zeros.
TEST(GltfInstances, MoreTrianglesThanASceneHoldsAreRefused) {
  GltfBuilder b;
  b.mesh(b.vec3(std::vector<float>(17 * 9)));
  b.node({{"mesh", 0}});
  b.json["accessors"].push_back({{"componentType", 5126}, {"count", 1 << 24}, {"type", "VEC3"}});
  expect_error(Failure::Work, {"place more than"}, [&] { with_instances({{"TRANSLATION", 1}}, b).load(); });
}

}  // namespace
}  // namespace ballot
