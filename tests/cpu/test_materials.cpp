// Tests of materials, textures, lights and skies from files, and of the scene features that follow from them.
#include <cmath>
#include <glm/geometric.hpp>

#include "engine/files/image.h"
#include "engine/files/make_sky.h"
#include "engine/model/mip_chain.h"
#include "gltf_builder.h"

namespace ballot::test {
namespace {

using nlohmann::json;

// A picture of 2 x 2 pixels: red, green; blue, white with alpha 0.
constexpr const char* kPng =
    "data:image/png;base64,"
    "iVBORw0KGgoAAAANSUhEUgAAAAIAAAACCAYAAABytg0kAAAAE0lEQVR42mP4z8DwHwyBNAgwAABIyQj4xTT9BQAAAABJRU5ErkJggg==";

/// A triangle with coordinates (0,0), (1,0), (0,1) and a material whose base colour is the picture.
GltfBuilder textured() {
  GltfBuilder b = one_triangle();
  b.primitive()["attributes"]["TEXCOORD_0"] = b.accessor(b.view(std::vector<float>{0, 0, 1, 0, 0, 1}), 5126, 3, "VEC2");
  b.primitive()["material"] = 0;
  b.json["images"] = {{{"uri", kPng}}};
  b.json["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9728}}};
  b.json["textures"] = {{{"source", 0}, {"sampler", 0}}};
  b.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}, {"metallicFactor", 0}}}}};
  return b;
}

TEST(Materials, TextureWithSamplerAndCoordinates) {
  const Scene scene = textured().load();
  ASSERT_EQ(scene.textures.size(), 1u);
  EXPECT_EQ(scene.textures[0].wrap_u, Wrap::Clamp);
  EXPECT_EQ(scene.textures[0].wrap_v, Wrap::Mirror);
  EXPECT_TRUE(scene.textures[0].nearest);
  ASSERT_EQ(scene.images.size(), 1u);
  EXPECT_TRUE(scene.images[0].srgb);
  EXPECT_EQ(scene.images[0].rgba,
            (std::vector<std::uint8_t>{255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 255, 255, 255, 0}));
  ASSERT_EQ(scene.uvs[0].size(), 1u);
  EXPECT_EQ(scene.uvs[0][0][1], glm::vec2(1, 0));
  EXPECT_TRUE(scene.uvs[1].empty());
  EXPECT_EQ(features_of(scene), (SceneFeatures{.base_texture = true, .perspective = true}));
}

TEST(Materials, OneImageInTwoColourSpacesIsTwoImages) {
  GltfBuilder b = textured();
  b.json["materials"][0]["pbrMetallicRoughness"]["metallicRoughnessTexture"] = {{"index", 0}};
  b.json["materials"][0]["normalTexture"] = {{"index", 0}, {"scale", 0.5}};
  const Scene scene = b.load();
  EXPECT_EQ(scene.images.size(), 2u);
  EXPECT_FALSE(scene.images[1].srgb);
  EXPECT_EQ(scene.materials[0].normal_texture.texture, scene.materials[0].surface_texture.texture);
  EXPECT_EQ(scene.materials[0].normal_scale, 0.5f);
  EXPECT_EQ(
      features_of(scene),
      (SceneFeatures{
          .glossy = true, .base_texture = true, .surface_texture = true, .normal_texture = true, .perspective = true}));
}

TEST(Materials, TextureTransformIsTranslationRotationScale) {
  GltfBuilder b = textured();
  b.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"]["KHR_texture_transform"] = {
      {"offset", {0.5, 0.25}}, {"rotation", 1.5707963267948966}, {"scale", {2, 4}}};
  b.json["extensionsRequired"] = {"KHR_texture_transform"};
  const TextureUse use = b.load().materials[0].base_texture;
  // (1, 0) is scaled to (2, 0), turned to (0, -2) and then moved.
  EXPECT_NEAR(use.row_u.x + use.row_u.z, 0.5, 1e-6);
  EXPECT_NEAR(use.row_v.x + use.row_v.z, -1.75, 1e-6);
  EXPECT_NEAR(use.row_u.y, 4, 1e-6);
}

TEST(Materials, AlphaUnlitAndWhatTheyAsk) {
  GltfBuilder b = one_triangle();
  b.primitive()["material"] = 0;
  b.json["materials"] = {{{"alphaMode", "MASK"},
                          {"alphaCutoff", 0.25},
                          {"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, 0.5}}}},
                          {"emissiveFactor", {1, 1, 1}},
                          {"extensions", {{"KHR_materials_unlit", json::object()}}}}};
  Scene scene = b.load();
  EXPECT_EQ(scene.materials[0].alpha_mode, Alpha::Mask);
  EXPECT_EQ(scene.materials[0].alpha_cutoff, 0.25f);
  EXPECT_EQ(scene.materials[0].alpha, 0.5f);
  EXPECT_EQ(features_of(scene), (SceneFeatures{.unlit = true, .alpha = true, .perspective = true}));
  scene.materials[0].alpha_mode = Alpha::Opaque;
  EXPECT_EQ(features_of(scene), (SceneFeatures{.unlit = true, .perspective = true}));
  b.json["materials"][0]["alphaMode"] = "GLASS";
  expect_error(Failure::Work, {"material 0", "GLASS", "OPAQUE, MASK or BLEND"}, [&] { b.load(); });
}

TEST(Materials, QuantizedCoordinates) {
  GltfBuilder b = textured();
  const int uv = b.accessor(b.view(std::vector<std::uint16_t>{0, 0, 65535, 0, 0, 65535}), 5123, 3, "VEC2");
  b.json["accessors"][uv]["normalized"] = true;
  b.primitive()["attributes"]["TEXCOORD_0"] = uv;
  EXPECT_EQ(b.load().uvs[0][0], (std::array{glm::vec2(0), glm::vec2(1, 0), glm::vec2(0, 1)}));
}

TEST(Materials, TexturesOfOtherKindsAreANote) {
  GltfBuilder b = textured();
  b.json["textures"][0].erase("source");
  b.json["textures"][0]["extensions"]["KHR_texture_basisu"]["source"] = 0;
  b.json["extensionsRequired"] = {"KHR_texture_basisu"};
  const Scene scene = b.load();
  EXPECT_FALSE(scene.materials[0].base_texture);
  ASSERT_EQ(scene.notes.size(), 2u);
  EXPECT_EQ(scene.notes[0], "The extension KHR_texture_basisu, which the file requires, was ignored.");
  EXPECT_EQ(scene.notes[1], "The texture 0 has no PNG, JPEG or WebP, so it was left out; so are others like it.");
}

TEST(Materials, ExtensionsThatAreNotModelledAreANote) {
  GltfBuilder b = textured();
  b.json["materials"][0]["extensions"] = {{"KHR_materials_clearcoat", {{"clearcoatFactor", 1}}},
                                          {"KHR_materials_ior", {{"ior", 1.4}}}};
  b.json["materials"].push_back(b.json["materials"][0]);  // not in use
  const Scene scene = b.load();
  ASSERT_EQ(scene.notes.size(), 1u);
  EXPECT_EQ(scene.notes[0], "KHR_materials_clearcoat is not modelled: 1 material is drawn without it.");
}

// The material of older files: its diffuse colour and texture, and roughness 1 - glossiness.
TEST(Materials, SpecularAndGlossiness) {
  GltfBuilder b = textured();
  b.json["extensionsRequired"] = b.json["extensionsUsed"] = {"KHR_materials_pbrSpecularGlossiness"};
  json& material = b.json["materials"][0] = {};
  json& gloss = material["extensions"]["KHR_materials_pbrSpecularGlossiness"];
  gloss = {{"diffuseFactor", {0.25, 0.5, 0.75, 0.5}}, {"glossinessFactor", 0.25}, {"diffuseTexture", {{"index", 0}}}};
  Scene scene = b.load();
  EXPECT_EQ(scene.materials[0].base_color, glm::vec3(0.25f, 0.5f, 0.75f));
  EXPECT_EQ(scene.materials[0].alpha, 0.5f);
  EXPECT_EQ(scene.materials[0].roughness, 0.75f);
  EXPECT_EQ(scene.materials[0].metallic, 0);
  EXPECT_TRUE(scene.materials[0].base_texture);
  EXPECT_TRUE(scene.images.at(0).srgb);
  ASSERT_EQ(scene.notes.size(), 1u);
  EXPECT_EQ(scene.notes[0],
            "KHR_materials_pbrSpecularGlossiness is read as diffuse colour and glossiness, without the specular "
            "colour: 1 material.");
  gloss = {{"specularGlossinessTexture", {{"index", 0}}}};  // glossiness in A: 1, 1, 1, 0
  scene = b.load();
  EXPECT_EQ(scene.materials[0].base_color, glm::vec3(1));
  EXPECT_EQ(scene.materials[0].roughness, 1);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(scene.images.at(0).rgba[4 * i + 1], i == 3 ? 255 : 0);
  gloss = json::object();
  EXPECT_EQ(b.load().materials[0].roughness, 0);  // glossiness is 1 unless given
  material["pbrMetallicRoughness"] = {{"baseColorFactor", {0, 1, 0, 1}}, {"metallicFactor", 1}};
  scene = b.load();  // what is modelled whole comes first
  EXPECT_EQ(scene.materials[0].base_color, glm::vec3(0, 1, 0));
  EXPECT_EQ(scene.materials[0].metallic, 1);
  EXPECT_TRUE(scene.notes.empty());
}

TEST(Materials, BrokenTexturesAreRefused) {
  const auto refuse = [](const GltfBuilder& b, std::initializer_list<std::string_view> parts) {
    expect_error(Failure::Work, parts, [&] { b.load(); });
  };
  GltfBuilder b = textured();
  b.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 7;
  refuse(b, {"material 0", "names texture 7", "the file has 1"});
  b = textured();
  b.json["images"][0]["uri"] = "data:image/png;base64,aGVsbG8=";
  refuse(b, {"image 0", "cannot be decoded", "expected a PNG, JPEG or WebP"});
  b = textured();
  b.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = 2;
  refuse(b, {"material 0", "texture coordinates 2", "TEXCOORD_0 to TEXCOORD_1"});
  b = textured();
  b.json["accessors"][1]["count"] = 2;
  refuse(b, {"2 texture coordinates for 3 vertices"});
}

TEST(Materials, TexturesWithoutTheirFileAreLeftOut) {
  GltfBuilder b = textured();
  b.json["images"][0]["uri"] = "missing.png";
  const Scene scene = b.load();
  EXPECT_EQ(scene.triangles.size(), 1u);
  EXPECT_TRUE(scene.textures.empty());
  ASSERT_EQ(scene.notes.size(), 1u);
  EXPECT_NE(scene.notes[0].find("missing.png, so the image 0"), std::string::npos) << scene.notes[0];
}

TEST(Materials, ImagesFromFilesBesideTheScene) {
  const TemporaryFolder folder;
  GltfBuilder b = textured();
  b.json["images"][0]["uri"] = "a%20picture.png";
  EXPECT_TRUE(load_scene(folder.write("built.glb", b.glb())).images.empty());
  folder.write("a picture.png", "not a picture");
  expect_error(Failure::Work, {"a picture.png", "cannot be decoded"},
               [&] { load_scene(folder.write("built.glb", b.glb())); });
  Image picture{.width = 1, .height = 1, .channels = {}, .attributes = {}};
  for (const char* name : {"R", "G", "B"}) picture.channels.push_back({name, Pixel::Float, {1}, {}});
  write_png(folder.path() / "a picture.png", picture);
  EXPECT_EQ(load_scene(folder.write("built.glb", b.glb())).images.at(0).rgba, std::vector<std::uint8_t>(4, 255));
}

TEST(Materials, PunctualLights) {
  GltfBuilder b = one_triangle();
  b.json["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "spot"}, {"color", {1, 0.5, 0}}, {"intensity", 4}, {"range", 9}, {"spot", {{"outerConeAngle", 0.5}}}}};
  b.json["extensionsRequired"] = {"KHR_lights_punctual"};
  b.node({{"translation", {1, 2, 3}}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  const Scene scene = b.load();
  ASSERT_EQ(scene.lights.size(), 1u);
  EXPECT_EQ(scene.lights[0].kind, Light::Kind::Spot);
  EXPECT_EQ(scene.lights[0].position, glm::vec3(1, 2, 3));
  EXPECT_EQ(scene.lights[0].direction, glm::vec3(0, 0, -1));
  EXPECT_EQ(scene.lights[0].intensity, glm::vec3(4, 2, 0));
  EXPECT_EQ(scene.lights[0].range, 9);
  EXPECT_EQ(scene.lights[0].outer_angle, 0.5f);
  EXPECT_EQ(features_of(scene), (SceneFeatures{.lights = true, .perspective = true}));
  b.json["nodes"][1]["extensions"]["KHR_lights_punctual"]["light"] = 3;
  expect_error(Failure::Work, {"node 1", "names light 3", "the file has 1"}, [&] { b.load(); });
}

TEST(Materials, MipMapsAverageLight) {
  // The mean of black and white in sRGB is half the light, not half the code value. Transparent pixels add no colour.
  const TextureImage image{.name = "checks",
                           .width = 3,
                           .height = 1,
                           .srgb = true,
                           .rgba = {0, 0, 0, 255, 255, 255, 255, 255, 255, 0, 0, 0}};
  const auto levels = mip_chain(image, true);
  ASSERT_EQ(levels.size(), 2u);
  EXPECT_NEAR(levels[1].texels[0].g, 0.5, 1e-6);
  EXPECT_NEAR(levels[1].texels[0].a, 2.0 / 3, 1e-6);
  EXPECT_NEAR(mip_chain(image, false)[1].texels[0].g, 1.0 / 3, 1e-6);
}

TEST(Sky, FromWords) {
  EXPECT_EQ(make_sky("none").kind, Sky::Kind::None);
  EXPECT_EQ(make_sky("1,2,3.5").radiance({0, 1, 0}), glm::vec3(1, 2, 3.5f));
  const Sky g = make_sky("gradient:0,0,1:1,1,1:0,0.5,0");
  EXPECT_EQ(g.radiance({0, 1, 0}), glm::vec3(0, 0, 1));
  EXPECT_EQ(g.radiance({1, 0, 0}), glm::vec3(1));
  EXPECT_EQ(g.radiance({0, -1, 0}), glm::vec3(0, 0.5f, 0));
  for (const char* bad : {"blue", "1,2", "1,2,3,4", "1,2,nan", "1,2,-1", "gradient:1,1,1", "gradient:a:b:c"})
    expect_error(Failure::Arguments, {"sky", bad, "FILE.exr"}, [&] { make_sky(bad); });
}

TEST(Sky, FromAPicture) {
  const TemporaryFolder folder;
  Image image{.width = 4, .height = 2, .channels = {}, .attributes = {}};
  for (const char* name : {"R", "G", "B"}) image.channels.push_back({name, Pixel::Float, {0, 1, 2, 3, 4, 5, 6, 7}, {}});
  write_exr(folder.path() / "sky.exr", image);
  const Sky sky = make_sky((folder.path() / "sky.exr").string());
  EXPECT_EQ(sky.radiance(glm::normalize(glm::vec3(0.1f, 0.5f, -1))), glm::vec3(2));    // ahead, a little to the right
  EXPECT_EQ(sky.radiance(glm::normalize(glm::vec3(-1, -0.5f, -0.1f))), glm::vec3(5));  // left and below
  image.height = 1;
  for (Channel& c : image.channels) c.floats.resize(4);
  write_exr(folder.path() / "wide.exr", image);
  expect_error(Failure::Work, {"wide.exr", "4 x 1", "twice as wide"},
               [&] { make_sky((folder.path() / "wide.exr").string()); });
  expect_error(Failure::Work, {"absent.exr"}, [&] { make_sky("absent.exr"); });
}

}  // namespace
}  // namespace ballot::test
