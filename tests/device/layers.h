// A scene of transparent layers, and its textures as they are in double precision.
#pragma once

#include <cmath>

#include "engine/model/scene.h"
#include "tests/cpu/shapes.h"

namespace ballot::layers {

inline constexpr std::uint32_t kSide = 8;  // texels of the image

inline glm::dvec4 texel(const Scene& scene, const Texture& texture, int x, int y) {
  const auto wrap = [](int at, Wrap mode) {
    const int side = int(kSide);
    if (mode == Wrap::Clamp) return std::clamp(at, 0, side - 1);
    const int period = mode == Wrap::Mirror ? 2 * side : side, in = (at % period + period) % period;
    return in < side ? in : period - 1 - in;
  };
  const std::uint8_t* at =
      &scene.images[0].rgba[std::size_t(wrap(y, texture.wrap_v) * int(kSide) + wrap(x, texture.wrap_u)) * 4];
  return glm::dvec4(at[0], at[1], at[2], at[3]) / 255.0;
}

/// Returns a texture where the weights u, v of vertices 1 and 2 say; NaN nearer than `border` to the border of a texel
/// that is not interpolated.
inline glm::dvec4 texture_at(const Scene& scene, const TextureUse& use, std::size_t triangle, double u, double v,
                             double border) {
  const auto& c = scene.uvs[use.set][triangle];
  const glm::dvec2 at_corner[]{glm::dvec2{c[0]}, glm::dvec2{c[1]}, glm::dvec2{c[2]}};
  const glm::dvec3 one{at_corner[0] * (1 - u - v) + at_corner[1] * u + at_corner[2] * v, 1.0};
  const Texture& texture = scene.textures[use.texture];
  glm::dvec2 at =
      double(kSide) * glm::dvec2(glm::dot(glm::dvec3(use.row_u), one), glm::dot(glm::dvec3(use.row_v), one));
  if (texture.nearest) {
    if (std::abs(at.x - std::round(at.x)) < border || std::abs(at.y - std::round(at.y)) < border)
      return glm::dvec4(NAN);
    return texel(scene, texture, int(std::floor(at.x)), int(std::floor(at.y)));
  }
  at -= 0.5;
  const int x = int(std::floor(at.x)), y = int(std::floor(at.y));
  const double s = at.x - x, t = at.y - y;
  const auto near = [&](int dx, int dy) { return texel(scene, texture, x + dx, y + dy); };
  return (1 - t) * ((1 - s) * near(0, 0) + s * near(1, 0)) + t * ((1 - s) * near(0, 1) + s * near(1, 1));
}

/// Returns layers of a square, one behind the other, each of another material.
inline Scene scene() {
  Scene scene;
  scene.name = "layers";
  shapes::Random random(3);
  TextureImage image{.name = "holes", .width = kSide, .height = kSide};
  for (std::uint32_t i = 0; i < kSide * kSide * 4; ++i)
    image.rgba.push_back(std::uint8_t(i % 8 == 3 ? 0 : random.in(0, 255.99f)));
  scene.images.push_back(std::move(image));
  scene.textures = {{.nearest = true}, {.wrap_u = Wrap::Mirror, .wrap_v = Wrap::Clamp}};
  const auto material = [&](Alpha mode, float alpha, float cutoff, std::uint32_t texture) {
    Material m;
    m.alpha_mode = mode, m.alpha = alpha, m.alpha_cutoff = cutoff, m.base_texture.texture = texture;
    m.base_texture.row_u = {0.5f, 1, 0.25f};
    m.base_color = {0.25f, 0.5f, 0.75f};
    scene.materials.push_back(m);
  };
  material(Alpha::Opaque, 0, 0.5f, 0);
  material(Alpha::Mask, 1, 0.5f, 0);
  material(Alpha::Mask, 0.8f, 0.3f, 1);
  material(Alpha::Blend, 0.5f, 0.5f, 0);
  material(Alpha::Mask, 1, 0.5f, kNoTexture);
  material(Alpha::Mask, 0.25f, 0.5f, kNoTexture);
  for (std::uint32_t layer = 0; layer < 18; ++layer)
    for (const bool upper : {false, true}) {
      const float z = float(layer), s = upper ? -1.f : 1.f;
      scene.triangles.push_back({{{-s, -s, z}, {s, -s, z}, {-s, s, z}}});
      scene.material_of.push_back(layer % 6);
      scene.uvs[0].push_back({glm::vec2(-s, -s), glm::vec2(s, -s), glm::vec2(-s, s)});
      const bool fades = layer % 6 == 4;
      scene.colors.push_back({glm::vec4(1), glm::vec4(1, 1, 1, fades ? 0 : 1), glm::vec4(1)});
    }
  finish_scene(scene);
  return scene;
}

}  // namespace ballot::layers
