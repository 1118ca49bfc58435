// Builds small animated glTF files for tests.
#pragma once

#include <utility>

#include "engine/model/pose.h"
#include "tests/cpu/gltf_builder.h"

namespace ballot::test {

/// A glTF file whose nodes move.
class AnimatedBuilder : public GltfBuilder {
 public:
  AnimatedBuilder() = default;
  AnimatedBuilder(GltfBuilder b) : GltfBuilder(std::move(b)) {}

  int scalars(const std::vector<float>& values) { return accessor(view(values), 5126, values.size(), "SCALAR"); }
  int vec4(const std::vector<float>& values) { return accessor(view(values), 5126, values.size() / 4, "VEC4"); }
  int mat4(const std::vector<float>& values) { return accessor(view(values), 5126, values.size() / 16, "MAT4"); }

  /// Adds a channel to an animation, which is made if it is new.
  nlohmann::json& channel(int node, const std::string& path, const std::vector<float>& times, int output,
                          const std::string& interpolation = "LINEAR", std::size_t animation = 0) {
    while (json["animations"].size() <= animation)
      json["animations"].push_back({{"channels", nlohmann::json::array()}, {"samplers", nlohmann::json::array()}});
    nlohmann::json& a = json["animations"][animation];
    a["samplers"].push_back({{"input", scalars(times)}, {"output", output}, {"interpolation", interpolation}});
    a["channels"].push_back({{"sampler", a["samplers"].size() - 1}, {"target", {{"node", node}, {"path", path}}}});
    return a;
  }

  /// Adds JOINTS_0 and WEIGHTS_0 to the first primitive, four of each for each vertex.
  void joints(const std::vector<std::uint8_t>& numbers, const std::vector<float>& weights) {
    primitive()["attributes"]["JOINTS_0"] = accessor(view(numbers), 5121, numbers.size() / 4, "VEC4");
    primitive()["attributes"]["WEIGHTS_0"] = vec4(weights);
  }
};

/// Returns a triangle that moves along x by 10 between the times 1 s and 2 s.
inline AnimatedBuilder moving_triangle() {
  AnimatedBuilder b = one_triangle();
  const int output = b.vec3({0, 0, 0, 10, 0, 0});
  b.channel(0, "translation", {1, 2}, output);
  return b;
}

/// Returns a triangle of a skin with two joints, the second of which is a child of the first. Vertex 0 follows the
/// first, vertex 1 the second, vertex 2 both alike. A clip moves the first along y and turns the second about z.
inline AnimatedBuilder skinned_triangle() {
  AnimatedBuilder b;
  b.mesh(b.vec3({0, 0, 0, 1, 0, 0, 2, 0, 0}));
  b.joints({0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 0.5f, 0.5f, 0, 0});
  b.node({{"mesh", 0}, {"skin", 0}, {"translation", {100, 0, 0}}});  // glTF ignores this translation
  b.node({{"children", {2}}});
  b.node({{"translation", {1, 0, 0}}});
  const int bind = b.mat4({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0,  0, 0, 1,  //
                           1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 1});
  b.json["skins"] = {{{"joints", {1, 2}}, {"inverseBindMatrices", bind}}};
  const int moves = b.vec3({0, 0, 0, 0, 4, 0}), turns = b.vec4({0, 0, 0, 1, 0, 0, 1, 0});
  b.channel(1, "translation", {0, 1}, moves);
  b.channel(2, "rotation", {0, 1}, turns);
  return b;
}

/// Returns the scene at a time of a clip.
inline Scene posed(Scene scene, double seconds, std::size_t clip = 0) {
  set_pose(scene, &scene.animation->clips[clip], seconds);
  return scene;
}

}  // namespace ballot::test
