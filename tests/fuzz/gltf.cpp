// glTF with its buffers: text or binary, embedded data or the file b.bin beside it.
#include "engine/core/memory.h"
#include "engine/files/load.h"
#include "tests/cpu/gltf_builder.h"
#include "tests/fuzz/fuzz.h"

namespace ballot::fuzz {

namespace {

using test::GltfBuilder;
using namespace std::string_literals;

GltfBuilder textured() {
  GltfBuilder b = test::one_triangle();
  const std::string png = "\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\1\0\0\0\1\x8\2\0\0\0\x90\x77\x53\xde"s;
  const int image = b.view(std::vector<char>(png.begin(), png.end()));
  b.json["images"] = {{{"bufferView", image}, {"mimeType", "image/png"}}};
  b.json["samplers"] = {{{"wrapS", 33071}, {"magFilter", 9728}}};
  b.json["textures"] = {{{"source", 0}, {"sampler", 0}}};
  b.json["materials"] = {{{"name", "m"},
                          {"alphaMode", "MASK"},
                          {"emissiveFactor", {1, 1, 1}},
                          {"pbrMetallicRoughness",
                           {{"baseColorTexture",
                             {{"index", 0}, {"extensions", {{"KHR_texture_transform", {{"offset", {0.5, 0.5}}}}}}}}}}}};
  b.primitive()["material"] = 0;
  b.primitive()["attributes"]["TEXCOORD_0"] = b.accessor(b.view(std::vector<float>(6)), 5126, 3, "VEC2");
  b.primitive()["attributes"]["NORMAL"] = b.vec3({0, 0, 1, 0, 0, 1, 0, 0, 1});
  return b;
}

GltfBuilder sparse() {
  GltfBuilder b = test::one_triangle();
  const int indices = b.view(std::vector<std::uint16_t>{0, 2});
  const int values = b.view(std::vector<float>{0, 0, 1, 0, 1, 1});
  b.json["accessors"][0]["sparse"] = {{"count", 2},
                                      {"indices", {{"bufferView", indices}, {"componentType", 5123}}},
                                      {"values", {{"bufferView", values}}}};
  b.primitive()["indices"] = b.indices({0, 1, 2, 2, 1, 0});
  b.primitive()["mode"] = 5;
  return b;
}

GltfBuilder instanced() {
  GltfBuilder b = test::one_triangle();
  b.json["extensionsUsed"] = {"EXT_mesh_gpu_instancing", "KHR_lights_punctual"};
  b.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] = b.vec3({0, 0, 0, 1, 1, 1});
  b.json["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 0.9}, {"znear", 0.1}}}}};
  b.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "spot"}, {"spot", {{"outerConeAngle", 0.5}}}}};
  b.node({{"camera", 0}, {"rotation", {0, 0, 0, 1}}, {"children", {0}}});
  b.json["nodes"].back()["extensions"]["KHR_lights_punctual"]["light"] = 0;
  b.json["scenes"] = {{{"nodes", {1}}}};
  return b;
}

/// Returns a file whose buffer is in a data URI, with a skin, a mirrored node that a clip turns back, and an old
/// material.
GltfBuilder moving() {
  GltfBuilder b = test::one_triangle();
  b.json["buffers"] = {{{"byteLength", 36}, {"uri", "data:;charset=utf-8,%00" + std::string(35, '0')}}};
  b.json["nodes"][0]["scale"] = {-1, 1, 1};
  const int keys = b.accessor(0, 5121, 2, "VEC4"), times = b.accessor(0, 5126, 2, "SCALAR"), scales = b.vec3({1, 1, 1});
  b.json["animations"] = {{{"samplers", {{{"input", times}, {"output", keys}}, {{"input", times}, {"output", scales}}}},
                           {"channels",
                            {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "rotation"}}}},
                             {{"sampler", 1}, {"target", {{"node", 0}, {"path", "scale"}}}}}}}};
  b.json["skins"] = {{{"joints", {0}}}};
  b.json["materials"] = {
      {{"extensions", {{"KHR_materials_pbrSpecularGlossiness", {{"diffuseFactor", {1, 0, 0, 1}}}}}}}};
  b.primitive()["material"] = 0;
  return b;
}

/// Returns JSON of many small values, which take many times their text in memory.
std::string many_values(const char* head, const char* each, const char* tail) {
  std::string text = std::string(R"({"asset":{"version":"2.0"},)") + head + "[" + each;
  for (int i = 0; i < 4000; ++i) text += std::string(",") + each;
  return text + "]" + tail;
}

std::vector<std::string> gltf_seeds() {
  std::vector<std::string> all{many_values("\"extras\":", "0", "}"), many_values("\"materials\":", "{}", "}"),
                               many_values("\"extensions\":{\"X\":", "0", "}}"), moving().json.dump()};
  for (const GltfBuilder& b : {test::one_triangle(), textured(), sparse(), instanced()}) {
    all.push_back(b.glb());
    GltfBuilder text = b;
    text.json["buffers"] = {{{"byteLength", b.data.size()}, {"uri", "b.bin"}}};
    all.push_back(text.json.dump());
  }
  return all;
}

std::vector<std::string> gltf_words() {
  return {"\"accessors\"",  "\"bufferView\"",
          "\"byteOffset\"", "\"byteLength\"",
          "\"byteStride\"", "\"componentType\"",
          "\"count\"",      "\"sparse\"",
          "\"indices\"",    "\"values\"",
          "\"uri\"",        "\"images\"",
          "\"children\"",   "\"matrix\"",
          "\"mesh\"",       "\"mode\"",
          "5120",           "5123",
          "5125",           "5126",
          "4294967296",     "-1",
          "1e308",          "18446744073709551615",
          "\"extras\"",     "\"data:application/octet-stream;base64,AAAA\"",
          "\"VEC3\"",       "\"SCALAR\"",
          "\"SCALAR\"",     "\"normalized\"",
          "\"TANGENT\"",    "\"skins\"",
          "\"animations\"", "\"default\"",
          "\"joints\"",     "\"data:;base64,AAAA\""};
}

void read_gltf(std::string_view input) {
  static const std::filesystem::path buffer = put("b.bin", std::string(512, '\0'));
  const std::filesystem::path path = put("s.gltf", input);
  for (const InstancePolicy policy : {InstancePolicy::Copy, InstancePolicy::Keep})
    expect_plain([&] { load_scene(path, {.instances = policy}); });
  set_memory_limit(1);  // what is left of any limit: the first reader that asks says so
  expect_plain([&] { load_scene(path); });
  prepare();
}

}  // namespace

Target gltf_target() { return {"gltf", Form::Gltf, gltf_seeds(), gltf_words(), read_gltf}; }

}  // namespace ballot::fuzz
