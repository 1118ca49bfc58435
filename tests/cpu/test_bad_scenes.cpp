// Tests that bad scene files are refused without a crash. The message must tell what is wrong, where, what was found
// and what was expected.
#include <sys/stat.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "gltf_builder.h"

namespace ballot::test {
namespace {

using nlohmann::json;

/// Writes `content` to a file of this name, loads it and expects that it is refused.
void refuse(const std::string& name, std::string_view content, std::initializer_list<std::string_view> parts) {
  const TemporaryFolder folder;
  const auto path = folder.write(name, content);
  expect_error(Failure::Work, {path.string()}, [&] { load_scene(path); });
  expect_error(Failure::Work, parts, [&] { load_scene(path); });
}

void refuse(const GltfBuilder& built, std::initializer_list<std::string_view> parts) {
  refuse("bad.glb", built.glb(), parts);
}

TEST(BadScenes, MissingFolderEmptyUnknown) {
  const TemporaryFolder folder;
  expect_error(Failure::Work, {"none.glb", "no such scene file"}, [&] { load_scene(folder.path() / "none.glb"); });
  expect_error(Failure::Work, {"is a folder"}, [&] { load_scene(folder.path()); });
  refuse("empty.glb", "", {"is empty (0 bytes)", ".glb"});
  refuse("empty.obj", "", {"is empty (0 bytes)", ".obj"});
  refuse("scene.fbx", "x", {"'.fbx'", ".gltf, .glb, .obj, .ply, .stl, .npy"});
  refuse("scene", "x", {"''", ".gltf, .glb, .obj"});
}

TEST(BadScenes, NotGltf) {
  refuse("bad.glb", "\x89PNG\r\n", {"is not glTF", "PNG"});
  refuse("bad.gltf", "hello", {"is not glTF", "'hell'"});
  refuse("bad.gltf", "{\"asset\":", {"not valid glTF", "its JSON is damaged or ends at byte 9 of 9"});
  refuse("bad.gltf", "{ \"scene\": 0 }", {"not valid glTF", "asset"});
  refuse("bad.gltf", R"({"asset":{"version":"1.0"}})", {"version '1.0'", "expected 2.0"});
  refuse("bad.gltf", R"({"asset":{"version":"2.0"},"extras":)" + std::string(100000, '['), {"deeper than 256"});
  const std::string deep = std::string(100000, '[') + std::string(100000, ']');
  for (const char* place : {"nodes", "extras", "meshes", "extensions"})
    refuse("bad.gltf", std::string(R"({"asset":{"version":"2.0"},")") + place + "\":" + deep + "}",
           {"bad.gltf: its JSON nests deeper than 256 brackets at byte"});
  GltfBuilder b = one_triangle();
  b.json["extras"] =
      std::string(1000, '[') + "\"\\" + std::string(1000, '{');  // brackets in a string count for nothing
  EXPECT_EQ(b.load().triangles.size(), 1u);
}

TEST(BadScenes, TruncatedGlb) {
  const std::string good = one_triangle().glb();
  refuse("bad.glb", good.substr(0, good.size() - 1),
         {"is cut short", std::to_string(good.size()) + " bytes", "has " + std::to_string(good.size() - 1)});
  refuse("bad.glb", good.substr(0, 10), {"is cut short: 10 bytes"});
  std::string bad = good;
  bad[4] = 1;
  refuse("bad.glb", bad, {"GLB version 1", "expected 2"});
  bad = good;
  bad[15] = 1;  // the length of the JSON chunk
  refuse("bad.glb", bad, {"its JSON chunk ends at byte"});
  bad = good;
  bad[bad.find(std::string("BIN\0", 4)) - 2] = 1;
  refuse("bad.glb", bad, {"its binary chunk ends at byte"});
}

TEST(BadScenes, ExtensionsThatAreNeeded) {
  GltfBuilder b = one_triangle();
  b.json["extensionsRequired"] = {"EXT_mesh_features"};
  refuse(b, {"EXT_mesh_features", "export it without it"});
  b.json["extensionsRequired"] = {"KHR_materials_clearcoat"};
  EXPECT_EQ(b.load().notes.size(), 1u);
}

TEST(BadScenes, CountsBeyondTheFile) {
  GltfBuilder b = one_triangle();
  b.json["accessors"][0]["count"] = 4;
  refuse(b, {"accessor 0 has 4 elements", "bufferView 0 (36 bytes) holds 3"});
  b.json["accessors"][0]["count"] = std::uint64_t{1} << 60;
  refuse(b, {"accessor 0 has 1152921504606846976 elements", "holds 3"});
  b.json["accessors"][0]["count"] = std::uint64_t{1} << 62;  // times 12 bytes wraps to 0
  refuse(b, {"holds 3"});
  b.json["accessors"][0]["count"] = 3;
  b.json["accessors"][0]["byteOffset"] = ~std::uint64_t{0} - 3;
  refuse(b, {"holds 0 from byte"});
  b.json["accessors"][0].erase("bufferView");
  b.json["accessors"][0]["count"] = std::uint64_t{1} << 60;
  refuse(b, {"no bufferView", "at most 16777216"});
}

TEST(BadScenes, BufferViewsOutOfRange) {
  GltfBuilder b = one_triangle();
  b.json["accessors"][0]["bufferView"] = 5;
  refuse(b, {"accessor 0 names bufferView 5, but the file has 1"});
  b.json["accessors"][0]["bufferView"] = -7;
  refuse(b, {"bufferView -7"});
  b = one_triangle();
  b.json["bufferViews"][0]["buffer"] = 2;
  refuse(b, {"bufferView 0 names buffer 2, but the file has 1"});
  b = one_triangle();
  b.json["bufferViews"][0]["byteLength"] = 40;
  refuse(b, {"bufferView 0 spans 40 bytes", "has 36"});
  b.json["bufferViews"][0]["byteOffset"] = ~std::uint64_t{0} - 8;
  refuse(b, {"bufferView 0 spans 40 bytes from byte 18446744073709551607"});
  b = one_triangle();
  b.json["bufferViews"][0]["byteStride"] = 8;
  refuse(b, {"byteStride of 8", "takes 12 bytes"});
}

/// Returns one triangle, and a material whose texture is an image in the buffer view `range`. `used`: the triangle has
/// the material.
GltfBuilder with_image(const json& range, bool used) {
  GltfBuilder b = one_triangle();
  b.primitive()["attributes"]["TEXCOORD_0"] = b.accessor(b.view(std::vector<float>{0, 0, 1, 0, 0, 1}), 5126, 3, "VEC2");
  b.json["bufferViews"].push_back({{"buffer", 0}});
  b.json["bufferViews"].back().update(range);
  b.json["images"] = {{{"bufferView", b.json["bufferViews"].size() - 1}, {"mimeType", "image/png"}}};
  b.json["textures"] = {{{"source", 0}}};
  b.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
  if (used) b.primitive()["material"] = 0;
  return b;
}

TEST(BadScenes, ImagesBeyondTheirBuffer) {
  for (const bool used : {true, false}) {
    refuse(with_image({{"byteOffset", 56}, {"byteLength", 8}}, used),
           {"bufferView 2 spans 8 bytes from byte 56, but buffer 0 has 60"});
    refuse(with_image({{"byteOffset", 0}, {"byteLength", 1 << 30}}, used),
           {"bufferView 2 spans 1073741824 bytes from byte 0, but buffer 0 has 60"});
    refuse(with_image({{"byteOffset", std::uint64_t{1} << 40}, {"byteLength", 8}}, used),
           {"bufferView 2 spans 8 bytes from byte 1099511627776, but buffer 0 has 60"});
    refuse(with_image({{"byteOffset", ~std::uint64_t{0} - 3}, {"byteLength", 8}}, used),
           {"bufferView 2 spans 8 bytes"});
    refuse(with_image({{"buffer", 7}, {"byteLength", 8}}, used), {"buffer", "7"});
    GltfBuilder b = with_image({{"byteLength", 8}}, used);
    b.json["images"][0]["bufferView"] = 9;
    refuse(b, {"image", "bufferView", "9"});
    b.json["images"][0]["bufferView"] = -2;
    refuse(b, {"image", "bufferView"});
  }
  refuse(with_image({{"byteLength", 8}}, true), {"image 0 cannot be decoded"});
  EXPECT_EQ(with_image({{"byteLength", 8}}, false).load().triangles.size(), 1u);
}

TEST(BadScenes, EmptyBuffersAndImagesAreNamed) {
  GltfBuilder b = one_triangle();
  b.json["images"] = {{{"uri", "data:image/png;base64,"}}};
  refuse(b, {"image 0 is empty"});
  b.json["images"] = {{{"uri", "data:image/png;base64,===="}}};
  refuse(b, {"image 0 has a data URI that cannot be decoded"});
  b = one_triangle();
  b.json["buffers"] = {{{"byteLength", 0}}};
  refuse(b, {"buffer 0 has no byteLength; expected a whole number above 0"});
}

TEST(BadScenes, NamesOfAbsentThings) {
  GltfBuilder b = one_triangle();
  b.primitive()["attributes"]["POSITION"] = 9;
  refuse(b, {"mesh 0 primitive 0 POSITION names accessor 9, but the file has 1"});
  b = one_triangle();
  b.json["meshes"][0]["name"] = "chair";
  b.primitive()["material"] = 3;
  refuse(b, {"mesh 0 ('chair') primitive 0 names material 3, but the file has 0"});
  b = one_triangle();
  b.node({{"mesh", 4}, {"name", "n"}});
  refuse(b, {"node 1 ('n') names mesh 4, but the file has 1"});
  b = one_triangle();
  b.node({{"camera", 0}});
  refuse(b, {"node 1 names camera 0, but the file has 0"});
  b = one_triangle();
  b.json["scenes"] = {{{"nodes", {3}}}};
  refuse(b, {"scene 0 names node 3, but the file has 1"});
  b.json["scene"] = 2;
  refuse(b, {"default scene is 2, but the file has 1"});
  b = one_triangle();
  b.primitive()["mode"] = 9;
  refuse(b, {"mode 9", "expected 0 to 6"});
}

TEST(BadScenes, WrongAccessorTypes) {
  GltfBuilder b = one_triangle();
  b.json["accessors"][0]["type"] = "VEC2";
  refuse(b, {"POSITION uses accessor 0", "expected VEC3"});
  b = one_triangle();
  b.primitive()["indices"] = 0;
  refuse(b, {"indices uses accessor 0", "expected SCALAR"});
  b = one_triangle();
  b.primitive()["attributes"]["NORMAL"] = b.vec3({0, 0, 1});
  refuse(b, {"1 normals for 3 vertices"});
}

TEST(BadScenes, IndexOutOfRange) {
  GltfBuilder b = one_triangle();
  b.primitive()["indices"] = b.indices({0, 1, 3});
  refuse(b, {"mesh 0 primitive 0 index 2 is 3, but it has 3 vertices"});
}

TEST(BadScenes, SparseOutOfRange) {
  const auto sparse = [](std::vector<std::uint8_t> indices, int count) {
    GltfBuilder b = one_triangle();
    const int at = b.view(indices), values = b.view(std::vector<float>{1, 2, 3, 4, 5, 6});
    b.json["accessors"][0]["sparse"] = {{"count", count},
                                        {"indices", {{"bufferView", at}, {"componentType", 5121}}},
                                        {"values", {{"bufferView", values}}}};
    return b;
  };
  refuse(sparse({0, 3}, 2), {"sparse index 3", "below 3"});
  refuse(sparse({1, 0}, 2), {"sparse index 0", "ascending"});
  refuse(sparse({0, 1}, 3), {"accessor 0 (sparse indices) has 3 elements", "holds 2"});
  refuse(sparse({0, 1, 2}, 3), {"accessor 0 (sparse values) has 3 elements", "holds 2"});
  refuse(sparse({0, 1}, -1), {"sparse part counts -1"});
}

TEST(BadScenes, VerticesThatAreNotFinite) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    GltfBuilder b;
    b.mesh(b.vec3({0, 0, 0, 1, 0, 0, 0, bad, 0}));
    b.json["meshes"][0]["name"] = "roof";
    b.node({{"mesh", 0}});
    refuse(b, {"mesh 0 ('roof') primitive 0 vertex 2 is (0, ", std::isnan(bad) ? "nan" : "inf", "finite"});
  }
  GltfBuilder b = one_triangle();
  b.json["nodes"][0]["scale"] = {1e200, 1, 1};
  refuse(b, {"vertex 1 is (1, 0, 0) in the file and (inf, 0, 0) in the world"});
}

TEST(BadScenes, IndicesOfExtensionsThatNoIntHolds) {
  for (const double bad : {1e308, -1.0, 0.5, 4294967296.0}) {
    GltfBuilder b = one_triangle();
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}}};
    b.json["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = bad;
    refuse(b, {"node 0 names light -1, but the file has 1"});
  }
}

TEST(BadScenes, NodesThatAreNoTree) {
  GltfBuilder b = one_triangle();
  b.json["nodes"] = {{{"children", {1}}}, {{"children", {2}}}, {{"children", {1}}}};
  refuse(b, {"node 1 is a child of node 0 and of node 2"});
  b.json["nodes"] = {{{"mesh", 0}}, {{"children", {2}}}, {{"children", {1}}}};
  refuse(b, {"node 1 is in a cycle"});
  b.json["nodes"] = {{{"children", {0}}}};
  refuse(b, {"node 0 is in a cycle"});
  b.json["nodes"] = {{{"children", {7}}}};
  refuse(b, {"node 0 names node 7, but the file has 1"});
  b.json["nodes"] = {{{"matrix", {1, 2, 3}}}};
  refuse(b, {"node 0 has a matrix of 3 numbers; expected 16"});
}

TEST(BadScenes, MissingAndShortBufferFiles) {
  const TemporaryFolder folder;
  GltfBuilder b = one_triangle();
  b.json["buffers"] = {{{"byteLength", 36}, {"uri", "gone.bin"}}};
  refuse("bad.gltf", b.json.dump(), {"'gone.bin' was not found"});
  folder.write("short.bin", "abc");
  b.json["buffers"][0]["uri"] = "short.bin";
  const auto path = folder.write("bad.gltf", b.json.dump());
  expect_error(Failure::Work, {"bad.gltf", "short.bin", "36", "3"}, [&] { load_scene(path); });
  b.json["buffers"][0]["uri"] = "data:application/octet-stream;base64,AAAA";
  refuse("bad.gltf", b.json.dump(), {"buffer 0 is cut short: its byteLength is 36, but its data URI has 3 bytes"});
  b.json["buffers"][0] = {{"byteLength", 0}};
  refuse("bad.glb", b.glb(), {"buffer 0 has no byteLength"});
}

TEST(BadScenes, ObjNamesFileAndLine) {
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  refuse("bad.obj", vertices + "f 1 2 4\n", {"bad.obj:4: face names vertex 4, but the file has 3"});
  refuse("bad.obj", vertices + "f 1 2 -4\n", {"bad.obj:4: face names vertex -4", "3 up to here"});
  refuse("bad.obj", vertices + "f 0 1 2\n", {"bad.obj:4: face names vertex 0; numbers begin at 1"});
  refuse("bad.obj", vertices + "f 1 2 x\n", {"bad.obj:4: face has 'x'"});
  refuse("bad.obj", vertices + "f 1 2 99999999999999999999\n", {"bad.obj:4: face has '9999"});
  for (const char* wide : {"2147483648", "4294967297", "9223372036854775807"})
    refuse("bad.obj", vertices + "f 1 2 " + wide + "\n", {"bad.obj:4: face names vertex ", wide});
  for (const char* wide : {"-2147483649", "-4294967295", "-9223372036854775808"})
    refuse("bad.obj", vertices + "f 1 2 " + wide + "\n", {"bad.obj:4: face names vertex ", wide, "3 up to here"});
  refuse("bad.obj", "v 0 0 0\nv 1 nan 0\n", {"bad.obj:2: vertex 2 is (1, nan, 0)", "finite"});
  refuse("bad.obj", "v 0 1e60 0\n", {"bad.obj:1: vertex 1 is (0, inf, 0)"});
  refuse("bad.obj", "\nv 0 1\n", {"bad.obj:2: vertex 1 has 2 coordinates; expected 3"});
  refuse("bad.obj", "v 0 1,5 0\n", {"bad.obj:1: vertex has '1,5' where a number is expected"});
  refuse("bad.obj", std::string("v 0\0 1 2\n", 9), {"is not OBJ", "byte 3 is zero"});
  refuse("bad.obj", "<html>\nhello\n", {"is not OBJ", "'<html>'"});
}

TEST(BadScenes, DevicesAndPipesAreNotRead) {
  const TemporaryFolder folder;
  ASSERT_EQ(::mkfifo((folder.path() / "pipe").c_str(), 0600), 0);
  ASSERT_EQ(::mkfifo((folder.path() / "pipe.glb").c_str(), 0600), 0);
  const auto refuse_in = [&](const std::string& name, const std::string& content,
                             std::initializer_list<std::string_view> parts) {
    const auto path = folder.write(name, content);
    expect_error(Failure::Work, parts, [&] { load_scene(path, {.allow_outside = true}); });
  };
  expect_error(Failure::Work, {"pipe.glb: it is a pipe; expected a regular file"},
               [&] { load_scene(folder.path() / "pipe.glb"); });
  GltfBuilder b = with_image({{"byteLength", 8}}, true);
  for (const auto& [uri, what] : {std::pair{"/dev/zero", "it is a device"}, std::pair{"pipe", "it is a pipe"}}) {
    b.json["images"] = {{{"uri", uri}}};
    refuse_in("image.glb", b.glb(), {uri, what, "expected a regular file"});
  }
  b = one_triangle();
  b.json["buffers"] = {{{"byteLength", 36}, {"uri", "pipe"}}};
  refuse_in("buffer.gltf", b.json.dump(), {"buffer.gltf", "buffer file", "it is a pipe; expected a regular file"});
  b.json["buffers"][0]["uri"] = "../../../../../../../../../../dev/zero";
  refuse_in("buffer.gltf", b.json.dump(), {"buffer.gltf", "buffer file", "it is a device"});
  const Scene scene = load_scene(folder.write("m.obj", "mtllib pipe /dev/zero\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
                                 {.allow_outside = true});
  EXPECT_EQ(scene.triangles.size(), 1u);
  EXPECT_FALSE(scene.notes.empty());
}

/// Loads a file of any content. It may throw nothing but Error.
void survive(const std::filesystem::path& path) {
  try {
    load_scene(path);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), Failure::Work) << error.what();
  }
}

// In the build with sanitizers, any access outside of these files is a failure.
TEST(BadScenes, TruncatedAndMutatedFilesNeverCrash) {
  GltfBuilder b = one_triangle();
  b.primitive()["indices"] = b.indices({0, 1, 2});
  b.primitive()["attributes"]["NORMAL"] = b.vec3({0, 0, 1, 0, 0, 1, 0, 0, 1});
  b.json["materials"] = {{{"pbrMetallicRoughness", {{"metallicFactor", 0}}}}};
  b.json["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 0.5}, {"znear", 0.1}}}}};
  b.json["nodes"][0]["children"] = {1};
  b.node({{"camera", 0}, {"rotation", {0, 0, 0, 1}}});
  GltfBuilder text = b;
  text.json["buffers"] = {
      {{"byteLength", 36}, {"uri", "data:application/octet-stream;base64," + std::string(48, 'A')}}};
  GltfBuilder images = with_image({{"byteLength", 36}}, true);
  const std::array files{
      std::pair{"m.glb", b.glb()}, std::pair{"images.glb", images.glb()}, std::pair{"m.gltf", text.json.dump()},
      std::pair{"m.obj",
                std::string("mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\ns 1\nf 1//1 2//1 3//1\nf -1 -2 -3\n")},
      std::pair{"m.mtl", std::string("newmtl a\nKd 1 1 1\nd 0.5\nillum 7\nmap_Kd -o 1 1 a.png\nNi 1.5\n")}};
  const TemporaryFolder folder;
  std::mt19937 random(1);  // fixed seed: the same mutants on every run
  for (const auto& [file, good] : files) {
    const std::string name = file;  // for the lambda: Clang 14 captures no part of a pair
    const bool is_mtl = name == "m.mtl";
    const auto load = [&](const std::string& content) {
      const auto path = folder.write(name, content);
      survive(is_mtl ? folder.write("user.obj", "mtllib m.mtl\n") : path);
    };
    for (std::size_t part = 0; part < 50; ++part) load(good.substr(0, good.size() * part / 50));
    for (int round = 0; round < 150; ++round) {
      std::string bad = good;
      for (int flips = 1 + round % 4; flips > 0; --flips) bad[random() % bad.size()] = static_cast<char>(random());
      load(bad);
    }
  }
}

}  // namespace
}  // namespace ballot::test
