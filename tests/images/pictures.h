// Scenes whose pictures are known, and pictures with their pixels at hand.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "engine/ballot.h"

namespace ballot::test {

/// A linear value as a window shows it, in steps of 8 bits.
inline int srgb(float x) {
  x = std::clamp(x, 0.0f, 1.0f);
  return int(std::lround(255 * (x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1 / 2.4f) - 0.055f)));
}

/// A picture, and what its engine said.
struct Picture {
  Image image;
  RenderTimes times;

  float at(const char* channel, std::uint32_t x, std::uint32_t y) const {
    return image.channel(channel).floats[std::size_t(y) * image.width + x];
  }
  std::uint32_t prim(std::uint32_t x, std::uint32_t y) const {
    return image.channel("prim").uints[std::size_t(y) * image.width + x];
  }
  glm::vec3 color(std::uint32_t x, std::uint32_t y) const { return {at("R", x, y), at("G", x, y), at("B", x, y)}; }
  glm::vec3 normal(std::uint32_t x, std::uint32_t y) const {
    return {at("N.X", x, y), at("N.Y", x, y), at("N.Z", x, y)};
  }
};

inline EngineOptions with_validation() {
  EngineOptions options;
  options.validate = true;
  options.use_cache = false;
  return options;
}

/// Renders and expects silence from the validation layers.
inline Picture render(Engine& engine, const View& view, const RenderOptions& options) {
  Picture picture;
  picture.image = engine.render(view, options, &picture.times);
  EXPECT_TRUE(engine.messages().empty()) << engine.messages().front();
  return picture;
}

inline Picture render(Scene scene, const RenderOptions& options) {
  Engine engine(std::move(scene), with_validation());
  return render(engine, engine.scene().views.front(), options);
}

inline View view_from(const glm::dvec3& eye, const glm::dmat4& turn = glm::dmat4(1)) {
  return {.name = "test", .world_from_camera = glm::translate(glm::dmat4(1), eye) * turn};
}

/// Two triangles in the plane z = `z`, facing +z; prims 0 (right and below the diagonal) and 1.
inline void add_rectangle(Scene& scene, glm::vec2 lo, glm::vec2 hi, float z, std::uint32_t material = 0) {
  const glm::vec3 a(lo, z), b(hi.x, lo.y, z), c(hi, z), d(lo.x, hi.y, z);
  scene.triangles.push_back({a, b, c});
  scene.triangles.push_back({a, c, d});
  scene.material_of.insert(scene.material_of.end(), 2, material);
}

/// A square of half width 1 at z = 0, seen from z = 3.
inline Scene square_scene() {
  Scene scene;
  scene.name = "square";
  scene.materials.push_back({.name = "paint", .base_color = {0.75f, 0.5f, 0.25f}});
  add_rectangle(scene, {-1, -1}, {1, 1}, 0);
  scene.views.push_back(view_from({0, 0, 3}));
  finish_scene(scene);
  return scene;
}

/// Where, in the frame of a camera, the ray through a point of the picture goes at depth 1: pixel (0, 0) covers
/// [0, 1) squared at the top left.
inline glm::dvec2 plane_point(const View& view, double x, double y, std::uint32_t width, std::uint32_t height) {
  const double half_y = view.orthographic ? view.ymag : std::tan(view.yfov / 2);
  return {(2 * x / width - 1) * half_y * width / height, (1 - 2 * y / height) * half_y};
}

}  // namespace ballot::test
