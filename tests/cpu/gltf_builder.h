// Builds small glTF files for tests: JSON and a buffer, which a test may edit freely before they are written.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "engine/core/error.h"
#include "engine/files/load.h"
#include "tests/temporary.h"

namespace ballot::test {

class GltfBuilder {
 public:
  nlohmann::json json = {{"asset", {{"version", "2.0"}}},
                         {"nodes", nlohmann::json::array()},
                         {"meshes", nlohmann::json::array()},
                         {"accessors", nlohmann::json::array()},
                         {"bufferViews", nlohmann::json::array()}};
  std::string data;

  template <class T>
  int view(const std::vector<T>& values, int stride = 0) {
    data.resize((data.size() + 3) / 4 * 4);
    json["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", data.size()}, {"byteLength", values.size() * sizeof(T)}});
    if (stride > 0) json["bufferViews"].back()["byteStride"] = stride;
    data.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
    return static_cast<int>(json["bufferViews"].size()) - 1;
  }

  int accessor(int buffer_view, int component_type, std::size_t count, const char* type) {
    json["accessors"].push_back(
        {{"bufferView", buffer_view}, {"componentType", component_type}, {"count", count}, {"type", type}});
    return static_cast<int>(json["accessors"].size()) - 1;
  }

  int vec3(const std::vector<float>& values) { return accessor(view(values), 5126, values.size() / 3, "VEC3"); }
  int indices(const std::vector<std::uint16_t>& values) {
    return accessor(view(values), 5123, values.size(), "SCALAR");
  }

  /// Adds a mesh of one primitive with these positions. Returns its index.
  int mesh(int positions) {
    json["meshes"].push_back({{"primitives", {{{"attributes", {{"POSITION", positions}}}}}}});
    return static_cast<int>(json["meshes"].size()) - 1;
  }
  nlohmann::json& primitive(int mesh = 0) { return json["meshes"][mesh]["primitives"][0]; }

  nlohmann::json& node(nlohmann::json content) {
    json["nodes"].push_back(std::move(content));
    return json["nodes"].back();
  }

  std::string glb() const {
    nlohmann::json whole = json;
    std::string bin = data;
    bin.resize((bin.size() + 3) / 4 * 4);
    if (!bin.empty() && !whole.contains("buffers")) whole["buffers"] = {{{"byteLength", data.size()}}};
    std::string text = whole.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::string out = "glTF";
    const auto word = [&out](std::size_t value) {
      const auto w = static_cast<std::uint32_t>(value);
      for (int shift = 0; shift < 32; shift += 8) out.push_back(static_cast<char>(w >> shift & 0xFF));
    };
    word(2);
    word(20 + text.size() + (bin.empty() ? 0 : 8 + bin.size()));
    word(text.size());
    out += "JSON" + text;
    if (!bin.empty()) {
      word(bin.size());
      out += std::string("BIN\0", 4) + bin;
    }
    return out;
  }

  /// Writes the file as a .glb into a temporary folder and loads it.
  Scene load(const LoadOptions& options = {}) const {
    const TemporaryFolder folder;
    return load_scene(folder.write("built.glb", glb()), options);
  }
};

/// Returns a file with one mesh, which is one triangle in the plane z = 0, placed by one node.
inline GltfBuilder one_triangle() {
  GltfBuilder b;
  b.mesh(b.vec3({0, 0, 0, 1, 0, 0, 0, 1, 0}));
  b.node({{"mesh", 0}});
  return b;
}

/// Expects an Error of this kind whose text contains every part.
template <class Call>
void expect_error(Failure kind, std::initializer_list<std::string_view> parts, Call&& call) {
  try {
    call();
    FAIL() << "expected an error about '" << *parts.begin() << "'";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), kind) << error.what();
    for (const std::string_view part : parts)
      EXPECT_NE(std::string_view(error.what()).find(part), std::string_view::npos)
          << "'" << part << "' is not in: " << error.what();
  }
}

}  // namespace ballot::test
