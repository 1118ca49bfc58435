// The bytes of glTF files: buffers in files and data URIs of every form, chunks of GLBs, and JSON that is large or odd.
#include <cmath>

#include "engine/core/memory.h"
#include "tests/cpu/animated.h"

namespace ballot::test {
namespace {

using nlohmann::json;

std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k)
      word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      text.push_back(k <= bytes.size() - i ? kDigits[word >> (18 - 6 * k) & 63] : '=');
  }
  return text;
}

std::string percent(std::string_view bytes) {
  std::string text;
  for (const char c : bytes) text += fmt::format("%{:02x}", static_cast<unsigned char>(c));
  return text;
}

/// Returns a file of one triangle whose buffer is at `uri`.
std::string with_uri(const std::string& uri, std::size_t length = 36) {
  GltfBuilder b = one_triangle();
  b.json["buffers"] = {{{"byteLength", length}, {"uri", uri}}};
  return b.json.dump();
}

Scene load_text(std::string_view text, const char* name = "data.gltf") {
  const TemporaryFolder folder;
  return load_scene(folder.write(name, text));
}

TEST(GltfData, DataUrisOfEveryForm) {
  const std::string bytes = one_triangle().data, text = base64(bytes);
  const Scene right = one_triangle().load();
  for (const char* head :
       {"data:application/octet-stream;base64,", "data:application/gltf-buffer;base64,", "data:;base64,",
        "data:application/octet-stream;charset=utf-8;base64,", "data:application/x-anything;name=a.bin;base64,",
        "DATA:Application/Octet-Stream;BASE64,", "data:text/plain;charset=US-ASCII;base64,"})
    EXPECT_EQ(load_text(with_uri(head + text)).triangles, right.triangles) << head;
  std::string escaped = text;
  for (std::size_t at = 0; (at = escaped.find('/', at)) != std::string::npos;) escaped.replace(at, 1, "%2F");
  for (const std::string& uri :
       {"data:;base64," + escaped, "data:," + percent(bytes), "data:application/octet-stream," + percent(bytes)})
    EXPECT_EQ(load_text(with_uri(uri)).triangles, right.triangles) << uri;
  const std::string unpadded = text.substr(0, text.find('='));
  EXPECT_EQ(load_text(with_uri("data:;base64," + unpadded)).triangles, right.triangles);
  EXPECT_EQ(load_text(with_uri("data:;base64," + base64(bytes + "more"))).triangles, right.triangles);
}

TEST(GltfData, BadDataUrisAreRefused) {
  const auto refuse = [](const std::string& uri, std::initializer_list<std::string_view> parts) {
    expect_error(Failure::Work, parts, [&] { load_text(with_uri(uri)); });
  };
  refuse("data:;base64,AA", {"buffer 0 is cut short: its byteLength is 36, but its data URI has 1 bytes"});
  refuse("data:;base64,A*AA", {"buffer 0 has a data URI that cannot be decoded as base64"});
  refuse("data:;base64,AAAAA", {"cannot be decoded"});
  refuse("data:;base64,AA==AA", {"cannot be decoded"});
  refuse("data:application/octet-stream;base64", {"buffer 0 has a data URI without a comma"});
}

TEST(GltfData, BufferFilesMayBeLonger) {
  const TemporaryFolder folder;
  folder.write("long.bin", one_triangle().data + "bytes of something else");
  const Scene scene = load_scene(folder.write("a.gltf", with_uri("long.bin")));
  EXPECT_EQ(scene.triangles, one_triangle().load().triangles);
  folder.write("b.gltf", with_uri("long.bin", 100));
  expect_error(Failure::Work, {"buffer 0 is cut short: its byteLength is 100, but its file 'long.bin' has 59 bytes"},
               [&] { load_scene(folder.path() / "b.gltf"); });
}

/// Returns a chunk of a GLB whose length counts `content` and not the padding behind it.
std::string chunk(const char* kind, std::string content, char padding) {
  std::string out;
  for (int shift = 0; shift < 32; shift += 8) out.push_back(static_cast<char>(content.size() >> shift & 0xFF));
  content.resize((content.size() + 3) / 4 * 4, padding);
  return out + std::string(kind, 4) + content;
}

std::string glb_of(const std::string& chunks) {
  std::string out = "glTF" + std::string("\2\0\0\0", 4);
  for (int shift = 0; shift < 32; shift += 8) out.push_back(static_cast<char>((chunks.size() + 12) >> shift & 0xFF));
  return out + chunks;
}

TEST(GltfData, ChunksOfOtherLengthsAndKinds) {
  GltfBuilder b = one_triangle();
  b.json["buffers"] = {{{"byteLength", 36}}};
  std::string text = b.json.dump();
  while (text.size() % 4 != 1) text += ' ';
  const std::string json_chunk = chunk("JSON", text, ' '), bin = chunk("BIN\0", b.data, '\0');
  const std::string other = chunk("ABCD", "extension", '\0');
  const auto expect_good = [](const std::string& file) {
    EXPECT_EQ(load_text(file, "a.glb").triangles, one_triangle().load().triangles);
  };
  expect_good(glb_of(json_chunk + bin));
  expect_good(glb_of(chunk("JSON", text + std::string(3, '\0'), ' ') + bin));  // padded with zeros
  expect_good(glb_of(json_chunk + bin + other));
  expect_good(glb_of(json_chunk + other + bin));
  expect_good(glb_of(json_chunk + bin) + "behind the end");
  expect_good(glb_of(json_chunk + chunk("BIN\0", b.data + "12345", '\0')));
  expect_error(Failure::Work, {"buffer 0 has no uri, and the file no binary chunk"},
               [&] { load_text(glb_of(json_chunk), "a.glb"); });
}

TEST(GltfData, AByteOrderMarkAndWholeNumbersAsFloats) {
  GltfBuilder b = one_triangle();
  b.json["buffers"] = {{{"byteLength", 36.0}, {"uri", "data:;base64," + base64(b.data)}}};
  b.json["nodes"][0]["mesh"] = 0.0;
  b.json["accessors"][0]["count"] = 3.0;
  EXPECT_EQ(load_text("\xEF\xBB\xBF" + b.json.dump()).triangles, one_triangle().load().triangles);
}

// tinygltf would take 2^32 for 0.
TEST(GltfData, NumbersBeyondIntAreRefused) {
  const auto refuse = [](const std::string& place, const json& number, const std::string& name) {
    GltfBuilder b = one_triangle();
    b.json[json::json_pointer(place)] = number;
    expect_error(Failure::Work, {"is not valid glTF 2.0: it has ", " as " + name + "; expected a number below 2^31"},
                 [&] { b.load(); });
  };
  for (const json& number : {json(4294967296), json(-4294967296), json(1e300), json(2147483648.0)}) {
    refuse("/nodes/0/mesh", number, "mesh");
    refuse("/nodes/0/children", {0, number}, "children");
    refuse("/scenes/0/nodes", {number}, "nodes");
  }
  refuse("/meshes/0/primitives/0/attributes/POSITION", 4294967296, "attributes");
  refuse("/meshes/0/primitives/0/targets", {{{"POSITION", 4294967296}}}, "targets");
  refuse("/accessors/0/sparse", {{"count", 4294967297}, {"indices", json::object()}, {"values", json::object()}},
         "sparse");
  GltfBuilder b = one_triangle();  // what is no such number may be large
  b.json["accessors"][0]["max"] = {4294967295u, 1, 1};
  b.json["nodes"][0]["extras"] = {{"mesh", 4294967296}};
  EXPECT_EQ(b.load().triangles, one_triangle().load().triangles);
}

TEST(GltfData, WhatIsMissingIsNamed) {
  const auto refuse = [](const char* list, const json& object, std::initializer_list<std::string_view> parts) {
    GltfBuilder b = one_triangle();
    b.json[list].push_back(object);
    expect_error(Failure::Work, parts, [&] { b.load(); });
  };
  refuse("skins", json::object(), {"is not valid glTF 2.0: skin 0 has no joints; expected an array"});
  refuse("skins", {{"name", "s"}, {"joints", 3}}, {"skin 0 ('s') has 3 as its joints; expected an array"});
  refuse("accessors", {{"componentType", 5126}, {"type", "VEC3"}},
         {"accessor 1 has no count; expected a whole number"});
  refuse("accessors", {{"componentType", 5126}, {"type", "VEC9"}, {"count", 1}},
         {"accessor 1 has \"VEC9\" as its type"});
  refuse("accessors", {{"componentType", 1}, {"type", "VEC3"}, {"count", 1}},
         {"accessor 1 has 1 as its componentType"});
  refuse("accessors", {{"componentType", 5126}, {"type", "VEC3"}, {"count", 1}, {"sparse", {{"count", 1}}}},
         {"accessor 1 sparse has no indices; expected an object"});
  refuse("bufferViews", {{"byteLength", 1}}, {"bufferView 1 has no buffer"});
  refuse("bufferViews", {{"buffer", 0}, {"byteLength", 4}, {"byteStride", 6}},
         {"bufferView 1 has 6 as its byteStride; expected a multiple of 4 up to 252"});
  refuse("meshes", {{"primitives", {json::object()}}}, {"mesh 1 primitive 0 has no attributes"});
  refuse("meshes", {{"primitives", {{{"attributes", {{"POSITION", "x"}}}}}}},
         {"mesh 1 primitive 0 has \"x\" as its POSITION"});
  refuse("animations", {{"channels", {json::object()}}, {"samplers", json::array()}},
         {"animation 0 channel 0 has no sampler"});
  refuse("cameras", {{"type", "fisheye"}}, {"camera 0 has \"fisheye\" as its type; expected perspective or"});
  refuse("cameras", {{"type", "perspective"}}, {"camera 0 has no perspective; expected an object"});
  refuse("nodes", 7, {"node 1 is no object"});
  refuse("materials", {{"emissiveFactor", {1}}}, {"material 0 has [1] as its emissiveFactor; expected three numbers"});
  GltfBuilder b = one_triangle();
  b.json["nodes"] = json::object();
  expect_error(Failure::Work, {"its nodes are no array"}, [&] { b.load(); });
  b = one_triangle();
  b.primitive()["indices"] = 7;
  expect_error(Failure::Work, {"name accessor 7, but the file has 1"}, [&] { b.load(); });
}

// What else is there is loaded, as before.
TEST(GltfData, EmptyMeshesAndAnimationsMoveAndShowNothing) {
  GltfBuilder b = one_triangle();
  b.json["meshes"].push_back(json::object());
  b.node({{"mesh", 1}});
  b.json["animations"] = {{{"channels", "none"}}};
  const Scene scene = b.load();
  EXPECT_EQ(scene.triangles, one_triangle().load().triangles);
  ASSERT_EQ(scene.notes.size(), 1u);
  EXPECT_NE(scene.notes[0].find("has no channels and moves nothing"), std::string::npos);
}

// Indices may have no bufferView: all are zero, or as a sparse part has them.
TEST(GltfData, IndicesWithoutABufferView) {
  GltfBuilder b = one_triangle();
  const int at = b.view(std::vector<std::uint8_t>{1, 2}), values = b.view(std::vector<std::uint16_t>{1, 2});
  b.json["accessors"].push_back({{"componentType", 5123},
                                 {"count", 3},
                                 {"type", "SCALAR"},
                                 {"sparse",
                                  {{"count", 2},
                                   {"indices", {{"bufferView", at}, {"componentType", 5121}}},
                                   {"values", {{"bufferView", values}}}}}});
  b.primitive()["indices"] = 1;
  EXPECT_EQ(b.load().triangles, one_triangle().load().triangles);
}

TEST(GltfData, AFileWithoutTrianglesSaysSo) {
  const Scene scene = GltfBuilder{}.load();
  ASSERT_EQ(scene.notes.size(), 1u);
  EXPECT_NE(scene.notes[0].find("holds no triangle"), std::string::npos);
}

// A quarter of a turn in keys of every type that glTF allows.
TEST(GltfData, RotationsOfEveryType) {
  const auto turned = [](int type, const auto& values) {
    AnimatedBuilder b = one_triangle();
    const int output = b.accessor(b.view(values), type, 2, "VEC4");
    b.json["accessors"][output]["normalized"] = type != 5126;
    b.channel(0, "rotation", {0, 1}, output);
    return posed(b.load(), 1).triangles[0];
  };
  const float h = std::sqrt(0.5f);
  const auto expect_turned = [](const Triangle& t, float most) {
    EXPECT_NEAR(t[1].y, 1, most);
    EXPECT_NEAR(t[2].x, -1, most);
  };
  expect_turned(turned(5126, std::vector<float>{0, 0, 0, 1, 0, 0, h, h}), 1e-6f);
  expect_turned(turned(5120, std::vector<std::int8_t>{0, 0, 0, 127, 0, 0, 90, 90}), 1e-6f);
  expect_turned(turned(5121, std::vector<std::uint8_t>{0, 0, 0, 255, 0, 0, 180, 180}), 1e-6f);
  expect_turned(turned(5122, std::vector<std::int16_t>{0, 0, 0, 32767, 0, 0, 23170, 23170}), 1e-6f);
  expect_turned(turned(5123, std::vector<std::uint16_t>{0, 0, 0, 65535, 0, 0, 46340, 46340}), 1e-6f);
}

// Two bytes of JSON are a value of 16 bytes for the parser, and of some 200 for tinygltf.
TEST(GltfData, TheMemoryLimitHoldsForJson) {
  const auto load = [](const std::string& head, const std::string& each, int count, const std::string& tail) {
    std::string text = R"({"asset":{"version":"2.0"},)" + head + "[" + each;
    for (int i = 1; i < count; ++i) text += "," + each;
    return load_text(text + "]" + tail);
  };
  const auto refuse = [&](const char* what, const auto& call) {
    expect_error(Failure::Work, {what, "of memory, but", "--memory"}, call);
  };
  const std::uint64_t used = std::uint64_t{512} << 20;  // of the other tests of this process, at most
  set_memory_limit(used + (std::uint64_t{128} << 20));
  EXPECT_TRUE(load("\"extras\":", "0", 1'000'000, "}").triangles.empty());  // nobody reads them
  refuse("what its JSON describes", [&] { load("\"extensions\":{\"X\":", "0", 4'000'000, "}}"); });
  refuse("what its JSON describes", [&] { load("\"nodes\":", "{}", 2'000'000, "}"); });
  set_memory_limit(0);
}

}  // namespace
}  // namespace ballot::test
