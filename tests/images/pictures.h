// Scenes whose pictures are known in closed form, and access to the pixels of rendered pictures.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "engine/scene/device_scene.h"

namespace ballot::test {

/// Returns the sRGB code, 0 to 255, that a window shows for a linear value.
inline int srgb(float x) {
  x = std::clamp(x, 0.0f, 1.0f);
  return int(std::lround(255 * (x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1 / 2.4f) - 0.055f)));
}

/// A rendered picture with the times that the engine reports for it.
struct Picture {
  Image image;
  RenderTimes times;

  float at(const char* channel, std::uint32_t x, std::uint32_t y) const {
    return image.channel(channel).floats[std::size_t(y) * image.width + x];
  }
  /// Number of the triangle that the pixel shows, or NO_HIT.
  std::uint32_t prim(std::uint32_t x, std::uint32_t y) const {
    return image.channel("prim").uints[std::size_t(y) * image.width + x];
  }
  glm::vec3 color(std::uint32_t x, std::uint32_t y) const { return {at("R", x, y), at("G", x, y), at("B", x, y)}; }
  glm::vec3 normal(std::uint32_t x, std::uint32_t y) const {
    return {at("N.X", x, y), at("N.Y", x, y), at("N.Z", x, y)};
  }
};

inline DeviceSceneOptions with_validation() {
  DeviceSceneOptions options;
  options.validate = true;
  options.use_cache = false;
  return options;
}

/// Renders a view and expects that the validation layers report nothing.
inline Picture render(DeviceScene& world, const View& view, const RenderOptions& options) {
  Picture picture;
  picture.image = world.render(view, options, &picture.times);
  EXPECT_TRUE(world.messages().empty()) << world.messages().front();
  return picture;
}

/// Renders the first view of a scene in an engine of its own.
inline Picture render(Scene scene, const RenderOptions& options) {
  DeviceScene world(std::move(scene), with_validation());
  return render(world, world.scene().views.front(), options);
}

/// Returns a perspective view from `eye` that looks along -z, turned by `turn`.
inline View view_from(const glm::dvec3& eye, const glm::dmat4& turn = glm::dmat4(1)) {
  return {.name = "test", .world_from_camera = glm::translate(glm::dmat4(1), eye) * turn};
}

/// Adds two triangles in the plane z = `z` that face +z. The first lies right of and below the diagonal.
inline void add_rectangle(Scene& scene, glm::vec2 lo, glm::vec2 hi, float z, std::uint32_t material = 0) {
  const glm::vec3 a(lo, z), b(hi.x, lo.y, z), c(hi, z), d(lo.x, hi.y, z);
  scene.material_of.resize(scene.triangles.size());  // a finished scene of one material lists none
  scene.triangles.push_back({a, b, c});
  scene.triangles.push_back({a, c, d});
  scene.material_of.insert(scene.material_of.end(), 2, material);
}

/// Returns a scene of one square of half width 1 at z = 0, seen from z = 3.
inline Scene square_scene() {
  Scene scene;
  scene.name = "square";
  scene.materials.push_back({.name = "paint", .base_color = {0.75f, 0.5f, 0.25f}});
  add_rectangle(scene, {-1, -1}, {1, 1}, 0);
  scene.views.push_back(view_from({0, 0, 3}));
  finish_scene(scene);
  return scene;
}

/// Returns the point at depth 1, in the frame of the camera, of the ray through point (x, y) of the picture.
/// Pixel (0, 0) covers [0, 1)^2 at the top left.
inline glm::dvec2 plane_point(const View& view, double x, double y, std::uint32_t width, std::uint32_t height) {
  const double half_y = view.orthographic ? view.ymag : std::tan(view.yfov / 2);
  return {(2 * x / width - 1) * half_y * width / height, (1 - 2 * y / height) * half_y};
}

}  // namespace ballot::test
