// Tests what the glTF loader makes of valid files.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "gltf_builder.h"

namespace ballot::test {
namespace {

using nlohmann::json;

Triangle tri(glm::vec3 a, glm::vec3 b, glm::vec3 c) { return {a, b, c}; }

/// Five vertices (k, 0, 0). The x of a triangle's corners shows which vertices it uses.
GltfBuilder numbered_vertices(int mode) {
  GltfBuilder b;
  b.mesh(b.vec3({0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0, 4, 0, 0}));
  b.primitive()["mode"] = mode;
  b.node({{"mesh", 0}});
  return b;
}

std::vector<std::array<int, 3>> corners(const Scene& scene) {
  std::vector<std::array<int, 3>> found;
  for (const Triangle& t : scene.triangles)
    found.push_back({static_cast<int>(t[0].x), static_cast<int>(t[1].x), static_cast<int>(t[2].x)});
  return found;
}

using Corners = std::vector<std::array<int, 3>>;

TEST(Gltf, OneTriangle) {
  const Scene scene = one_triangle().load();
  ASSERT_EQ(scene.triangles.size(), 1u);
  EXPECT_EQ(scene.triangles[0], tri({0, 0, 0}, {1, 0, 0}, {0, 1, 0}));
  EXPECT_EQ(scene.name, "built");
  EXPECT_TRUE(scene.normals.empty());
  EXPECT_EQ(scene.views[0].name, "view0");
}

TEST(Gltf, WithoutTrianglesIsValid) {
  const Scene scene = GltfBuilder{}.load();
  EXPECT_TRUE(scene.triangles.empty());
  EXPECT_EQ(scene.materials.size(), 1u);
}

TEST(Gltf, StripsAndFansFollowTheSpecification) {
  EXPECT_EQ(corners(numbered_vertices(5).load()), (Corners{{0, 1, 2}, {1, 3, 2}, {2, 3, 4}}));
  EXPECT_EQ(corners(numbered_vertices(6).load()), (Corners{{1, 2, 0}, {2, 3, 0}, {3, 4, 0}}));
}

TEST(Gltf, IncompleteTriangleAndOtherModesAreNoted) {
  const Scene scene = numbered_vertices(4).load();
  EXPECT_EQ(corners(scene), (Corners{{0, 1, 2}}));
  ASSERT_EQ(scene.notes.size(), 1u);
  EXPECT_NE(scene.notes[0].find("5 corners"), std::string::npos) << scene.notes[0];
  for (const int mode : {0, 1, 2, 3}) {
    const Scene lines = numbered_vertices(mode).load();
    EXPECT_TRUE(lines.triangles.empty());
    EXPECT_EQ(lines.notes.size(), 2u);  // the other: there is no triangle
  }
}

TEST(Gltf, IndicesOfAllSizes) {
  const auto check = [](auto sample, int component_type) {
    GltfBuilder b = numbered_vertices(4);
    const std::vector<decltype(sample)> values{4, 2, 0, 1, 2, 3};
    b.primitive()["indices"] = b.accessor(b.view(values), component_type, values.size(), "SCALAR");
    EXPECT_EQ(corners(b.load()), (Corners{{4, 2, 0}, {1, 2, 3}})) << component_type;
  };
  check(std::uint8_t{}, 5121);
  check(std::uint16_t{}, 5123);
  check(std::uint32_t{}, 5125);
}

TEST(Gltf, InterleavedVertices) {
  GltfBuilder b;
  const int view = b.view(std::vector<float>{0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 1}, 24);
  b.mesh(b.accessor(view, 5126, 3, "VEC3"));
  const int normal = b.accessor(view, 5126, 3, "VEC3");
  b.json["accessors"][normal]["byteOffset"] = 12;
  b.primitive()["attributes"]["NORMAL"] = normal;
  b.node({{"mesh", 0}});
  const Scene scene = b.load();
  EXPECT_EQ(scene.triangles.at(0), tri({0, 0, 0}, {1, 0, 0}, {0, 1, 0}));
  EXPECT_EQ(scene.normals.at(0)[1], glm::vec3(0, 0, 1));
}

TEST(Gltf, SparsePositionsWithAndWithoutBase) {
  for (const bool base : {true, false}) {
    GltfBuilder b = one_triangle();
    json& accessor = b.json["accessors"][0];
    if (!base) accessor.erase("bufferView");
    const int indices = b.view(std::vector<std::uint8_t>{1, 2});
    const int values = b.view(std::vector<float>{5, 6, 7, 8, 9, 10});
    b.json["accessors"][0]["sparse"] = {{"count", 2},
                                        {"indices", {{"bufferView", indices}, {"componentType", 5121}}},
                                        {"values", {{"bufferView", values}}}};
    EXPECT_EQ(b.load().triangles.at(0), tri({0, 0, 0}, {5, 6, 7}, {8, 9, 10})) << base;
  }
}

TEST(Gltf, QuantizedPositionsAndNormals) {
  GltfBuilder b;
  const int position =
      b.accessor(b.view(std::vector<std::int16_t>{0, 0, 0, 0, 32767, 0, 0, 0, 0, -32768, 0, 0}, 8), 5122, 3, "VEC3");
  b.json["accessors"][position]["normalized"] = true;
  b.mesh(position);
  const int normal =
      b.accessor(b.view(std::vector<std::int8_t>{0, 0, 127, 0, 0, 0, 127, 0, 0, 0, 127, 0}, 4), 5120, 3, "VEC3");
  b.json["accessors"][normal]["normalized"] = true;
  b.primitive()["attributes"]["NORMAL"] = normal;
  b.json["extensionsRequired"] = {"KHR_mesh_quantization"};
  b.node({{"mesh", 0}, {"scale", {2, 2, 2}}});
  const Scene scene = b.load();
  EXPECT_EQ(scene.triangles.at(0), tri({0, 0, 0}, {2, 0, 0}, {0, -2, 0}));
  EXPECT_EQ(scene.normals.at(0)[0], glm::vec3(0, 0, 1));
  EXPECT_TRUE(scene.notes.empty());
}

TEST(Gltf, TransformsAreComposedDownTheTree) {
  GltfBuilder b = one_triangle();
  b.json["nodes"] = json::array();
  b.node({{"children", {1}}, {"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 10, 20, 30, 1}}});
  const double h = std::sqrt(0.5);  // a quarter turn about z: x becomes y
  b.node({{"mesh", 0}, {"translation", {1, 0, 0}}, {"rotation", {0, 0, h, h}}, {"scale", {2, 3, 1}}});
  const Scene scene = b.load();
  const Triangle expected = tri({11, 20, 30}, {11, 22, 30}, {8, 20, 30});
  for (std::size_t k = 0; k < 3; ++k) EXPECT_LT(glm::length(scene.triangles.at(0)[k] - expected[k]), 1e-5f) << k;
}

TEST(Gltf, VerticesAreRoundedOnce) {
  // 1 + 2^-24 is no float. If the translation or the product were rounded before the sum, the result would be 1.
  GltfBuilder b = one_triangle();
  b.json["nodes"] = json::array();
  b.node({{"children", {1}}, {"translation", {-1.0, 0, 0}}});
  b.node({{"mesh", 0}, {"translation", {1.0 + std::ldexp(1.0, -30), 0, 0}}});
  EXPECT_EQ(b.load().triangles.at(0)[0].x, std::ldexp(1.0f, -30));
}

TEST(Gltf, TrianglesAreNumberedDepthFirstInFileOrder) {
  GltfBuilder b;
  for (int m = 0; m < 4; ++m) {
    const auto x = static_cast<float>(m);
    b.mesh(b.vec3({x, 0, 0, x, 1, 0, x, 0, 1, x, 0, 0, x, 1, 0, x, 0, 1}));
  }
  json second = b.primitive(0);
  second["attributes"]["POSITION"] = b.vec3({9, 0, 0, 9, 1, 0, 9, 0, 1});
  b.json["meshes"][0]["primitives"].push_back(second);
  b.node({{"mesh", 3}});
  b.node({{"mesh", 1}, {"children", {3, 2}}});
  b.node({{"mesh", 2}});
  b.node({{"mesh", 0}, {"children", {4}}});
  b.node({{"mesh", 3}});
  b.node({{"mesh", 1}});  // in no scene
  b.json["scenes"] = {{{"nodes", {5}}}, {{"nodes", {1, 0}}}};
  b.json["scene"] = 1;
  std::vector<int> order;
  for (const Triangle& t : b.load().triangles) order.push_back(static_cast<int>(t[0].x));
  EXPECT_EQ(order, (std::vector<int>{1, 1, 0, 0, 9, 3, 3, 2, 2, 3, 3}));
}

TEST(Gltf, DefaultSceneElseSceneZeroElseRoots) {
  GltfBuilder b = one_triangle();
  b.node({{"mesh", 0}, {"translation", {5, 0, 0}}});
  EXPECT_EQ(b.load().triangles.size(), 2u);
  b.json["scenes"] = {{{"nodes", {1}}}, {{"nodes", {0}}}};
  EXPECT_EQ(b.load().triangles.at(0)[0].x, 5);
  b.json["scene"] = 1;
  EXPECT_EQ(b.load().triangles.at(0)[0].x, 0);
}

TEST(Gltf, NormalsTurnWithTheInverseTranspose) {
  GltfBuilder b = one_triangle();
  b.primitive()["attributes"]["NORMAL"] = b.vec3({3, 4, 0, 0, 0, 0, 0, 0, 2});
  b.json["nodes"][0]["scale"] = {2, 1, 1};
  const auto normals = b.load().normals.at(0);
  const glm::vec3 expected = glm::normalize(glm::vec3(1.5f, 4, 0));
  EXPECT_LT(glm::length(normals[0] - expected), 1e-6f);
  EXPECT_EQ(normals[1], glm::vec3(0, 0, 1));  // zero in the file, so the geometric normal is used
  EXPECT_EQ(normals[2], glm::vec3(0, 0, 1));
  b.json["nodes"][0]["scale"] = {1, 1, -1};
  EXPECT_EQ(b.load().normals.at(0)[1], glm::vec3(0, 0, -1));  // a mirrored surface faces the other way
}

TEST(Gltf, PrimitivesWithoutNormalsGetGeometricOnesIfOthersHaveThem) {
  GltfBuilder b = one_triangle();
  b.mesh(b.vec3({0, 0, 0, 0, 0, 1, 1, 0, 0}));
  b.primitive()["attributes"]["NORMAL"] = b.vec3({0, 0, 1, 0, 0, 1, 0, 0, 1});
  b.node({{"mesh", 1}});
  EXPECT_EQ(b.load().normals.at(1)[0], glm::vec3(0, 1, 0));
}

TEST(Gltf, Materials) {
  GltfBuilder b = one_triangle();
  b.json["materials"] = {
      {{"name", "plain"}},
      {{"name", "metal"}, {"pbrMetallicRoughness", {{"baseColorFactor", {0.25, 0.5, 0.75, 1}}}}},
      {{"name", "lamp"},
       {"emissiveFactor", {1, 0.5, 0}},
       {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 4}}}}}},
      {{"name", "water"},
       {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 0.125}}},
       {"extensions",
        {{"KHR_materials_transmission", {{"transmissionFactor", 0.5}}}, {"KHR_materials_ior", {{"ior", 1.33}}}}}}};
  b.primitive()["material"] = 3;
  b.mesh(0);
  b.node({{"mesh", 1}});
  const Scene scene = b.load();
  ASSERT_EQ(scene.materials.size(), 5u);  // the last one is for the primitive without a material
  EXPECT_EQ(scene.material_of, (std::vector<std::uint32_t>{3, 4}));
  EXPECT_EQ(scene.materials[0].metallic, 0);
  EXPECT_EQ(scene.materials[1].metallic, 1);
  EXPECT_EQ(scene.materials[1].base_color, glm::vec3(0.25f, 0.5f, 0.75f));
  EXPECT_EQ(scene.materials[2].emissive, glm::vec3(4, 2, 0));
  EXPECT_EQ(scene.materials[3].transmission, 0.5f);
  EXPECT_EQ(scene.materials[3].ior, 1.33f);
  EXPECT_EQ(scene.materials[3].roughness, 0.125f);
}

TEST(Gltf, CamerasBecomeRigidViews) {
  GltfBuilder b = one_triangle();
  b.json["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 0.5}, {"znear", 0.1}}}},
                       {{"type", "orthographic"},
                        {"name", "plan"},
                        {"orthographic", {{"xmag", 3}, {"ymag", 2}, {"znear", 0.1}, {"zfar", 9}}}}};
  b.json["nodes"][0]["scale"] = {2, -3, 4};
  b.json["nodes"][0]["children"] = {1, 2, 3};
  b.node({{"camera", 0}, {"name", "front"}, {"translation", {1, 1, 1}}});
  b.node({{"camera", 1}});
  b.node({{"camera", 0}});
  const Scene scene = b.load();
  ASSERT_EQ(scene.views.size(), 3u);
  EXPECT_EQ(scene.views[0].name, "front");
  EXPECT_EQ(scene.views[1].name, "plan");
  EXPECT_EQ(scene.views[2].name, "view2");
  EXPECT_EQ(scene.views[0].yfov, 0.5);
  EXPECT_TRUE(scene.views[1].orthographic);
  EXPECT_EQ(scene.views[1].ymag, 2);
  const glm::dmat4& m = scene.views[0].world_from_camera;
  EXPECT_EQ(glm::dvec3(m[3]), glm::dvec3(2, -3, 4));
  EXPECT_NEAR(glm::determinant(glm::dmat3(m)), 1, 1e-12);
  EXPECT_EQ(glm::dvec3(m[2]), glm::dvec3(0, 0, 1));
}

TEST(Gltf, TextAndExternalBufferLoadLikeBinary) {
  const TemporaryFolder folder;
  GltfBuilder b = one_triangle();
  b.json["buffers"] = {{{"byteLength", b.data.size()}, {"uri", "some%20data.bin"}}};
  folder.write("some data.bin", b.data);
  EXPECT_EQ(load_scene(folder.write("text.gltf", b.json.dump())).triangles, one_triangle().load().triangles);
}

TEST(Gltf, ImagesThatNoMaterialInUseWantsAreNotOpened) {
  GltfBuilder b = one_triangle();
  b.json["images"] = {{{"uri", "missing.png"}}, {{"bufferView", 0}, {"mimeType", "image/png"}}};
  b.json["textures"] = {{{"source", 0}}};
  b.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
  const Scene scene = b.load();
  EXPECT_EQ(scene.triangles.size(), 1u);
  EXPECT_TRUE(scene.textures.empty() && scene.images.empty() && scene.uvs[0].empty());
  EXPECT_TRUE(scene.notes.empty());
}

TEST(Gltf, DeepTreesNeedNoStack) {
  GltfBuilder b = one_triangle();
  b.json["nodes"] = json::array();
  for (int i = 0; i < 20000; ++i) b.node({{"children", {i + 1}}});
  b.node({{"mesh", 0}});
  EXPECT_EQ(b.load().triangles.size(), 1u);
}

TEST(Gltf, ColoursOfVertices) {
  GltfBuilder b = one_triangle();
  b.mesh(b.vec3({0, 0, 1, 1, 0, 1, 0, 1, 1}));
  b.node({{"mesh", 1}});
  const int bytes =
      b.accessor(b.view(std::vector<std::uint8_t>{255, 0, 0, 51, 0, 255, 0, 255, 0, 0, 255, 0}), 5121, 3, "VEC4");
  b.json["accessors"][bytes]["normalized"] = true;
  b.primitive(0)["attributes"]["COLOR_0"] = bytes;
  const Scene scene = b.load();
  ASSERT_EQ(scene.colors.size(), 2u);
  EXPECT_EQ(scene.colors[0], (std::array{glm::vec4(1, 0, 0, 0.2f), glm::vec4(0, 1, 0, 1), glm::vec4(0, 0, 1, 0)}));
  EXPECT_EQ(scene.colors[1], (std::array{glm::vec4(1), glm::vec4(1), glm::vec4(1)}));  // a primitive without
  EXPECT_TRUE(features_of(scene).vertex_colors);
  b.primitive(0)["attributes"]["COLOR_0"] = b.vec3({2, 0, 0, 0, -1, 0, 0, 0, 0.5f});
  EXPECT_EQ(b.load().colors[0], (std::array{glm::vec4(2, 0, 0, 1), glm::vec4(0, 0, 0, 1), glm::vec4(0, 0, 0.5f, 1)}));
  b.primitive(0)["attributes"]["COLOR_0"] = b.vec3({1, 1, 1, 1, 1, 1});
  expect_error(Failure::Work, {"mesh 0 primitive 0 has 2 colours for 3 vertices"}, [&] { b.load(); });
  b.primitive(0)["attributes"]["COLOR_0"] = b.indices({1, 2, 3});
  expect_error(Failure::Work, {"COLOR_0", "expected VEC3 or VEC4"}, [&] { b.load(); });
}

}  // namespace
}  // namespace ballot::test
