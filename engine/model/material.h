// Materials of the glTF 2.0 metallic-roughness model, and their textures.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

namespace ballot {

inline constexpr float kMirrorRoughness = 0.05f;  // below it a surface reflects and refracts a ray into one ray
inline constexpr std::size_t kUvSets = 2;         // TEXCOORD_0 and TEXCOORD_1
inline constexpr std::uint32_t kNoTexture = ~0u;

/// An image with the pixels of the file. Mip maps are made on upload.
struct TextureImage {
  std::string name = {};
  std::uint32_t width = 0, height = 0;  // 1 to 16384 each
  bool srgb = false;                    // R, G, B are encoded by IEC 61966-2-1; else linear. A is always linear
  std::vector<std::uint8_t> rgba = {};  // width * height * 4, row by row from the top
};

enum class Wrap : std::uint32_t { Repeat = 0, Clamp = 1, Mirror = 2 };

/// An image with its sampler.
struct Texture {
  std::uint32_t image = 0;  // index into Scene::images
  Wrap wrap_u = Wrap::Repeat, wrap_v = Wrap::Repeat;
  bool nearest = false;  // no interpolation when magnified
};

/// A texture of a material, and the transform of its coordinates (KHR_texture_transform). The texture is looked up at
/// (row_u . (u, v, 1), row_v . (u, v, 1)) for the coordinates (u, v) of one set. (0, 0) is the top left corner of the
/// image.
struct TextureUse {
  std::uint32_t texture = kNoTexture;  // index into Scene::textures
  std::uint32_t set = 0;               // below kUvSets
  glm::vec3 row_u{1, 0, 0}, row_v{0, 1, 0};

  explicit operator bool() const { return texture != kNoTexture; }
  bool operator==(const TextureUse&) const = default;
};

enum class Alpha : std::uint32_t { Opaque = 0, Mask = 1, Blend = 2 };

/// A material. Factors are multiplied by their textures.
struct Material {
  std::string name = {};
  glm::vec3 base_color{1};  // linear Rec.709; times base_texture
  float metallic = 0;       // glTF's default of 1 applies only if pbrMetallicRoughness is present
  float roughness = 1;
  glm::vec3 emissive{0};   // radiance: emissiveFactor times KHR_materials_emissive_strength; times emissive_texture
  float transmission = 0;  // KHR_materials_transmission, rendered as solid glass
  float ior = 1.5f;        // index of refraction, KHR_materials_ior
  float alpha = 1;         // of baseColorFactor; times the alpha of base_texture
  Alpha alpha_mode = Alpha::Opaque;
  float alpha_cutoff = 0.5f;  // mode Mask: a surface with a lower alpha is absent
  bool unlit = false;         // KHR_materials_unlit: the colour is seen as it is, without lighting
  float normal_scale = 1;
  TextureUse base_texture{}, surface_texture{}, emissive_texture{},
      normal_texture{};  // surface: G roughness, B metallic

  std::array<const TextureUse*, 4> uses() const {
    return {&base_texture, &surface_texture, &emissive_texture, &normal_texture};
  }
  bool operator==(const Material&) const = default;
  bool emits() const { return !unlit && (emissive.x > 0 || emissive.y > 0 || emissive.z > 0); }
  /// Returns true if the material follows Lambert's law alone. A dielectric of roughness 1 counts: it is rendered
  /// without its 4 % of rough reflection.
  bool is_lambert() const {
    return metallic <= 0 && transmission <= 0 && (roughness >= 1 || ior <= 1) && !surface_texture;
  }
};

}  // namespace ballot
