#include "engine/render/data/texture_data.h"

#include <algorithm>
#include <bit>
#include <glm/packing.hpp>
#include <limits>

#include "engine/core/error.h"
#include "engine/core/memory.h"
#include "engine/model/mip_chain.h"

namespace ballot {

namespace {

std::uint32_t word(float value) { return std::bit_cast<std::uint32_t>(value); }

/// Returns true if some material takes its alpha from the image.
bool gives_alpha(const Scene& scene, std::size_t image) {
  for (const Material& m : scene.materials)
    if (m.alpha_mode != Alpha::Opaque && m.base_texture && scene.textures[m.base_texture.texture].image == image)
      return true;
  return false;
}

/// The place of an image among the packed texels, its mip levels and its mean colour.
struct PackedImage {
  std::uint32_t first, levels;
  glm::vec3 mean;
};

void append(const MipLevel& level, std::vector<glm::uvec4>& texels, std::uint32_t& count) {
  for (const glm::vec4& t : level.texels) {
    const std::uint32_t lo = glm::packHalf2x16({t.r, t.g}), hi = glm::packHalf2x16({t.b, t.a});
    if (count % 2 == 0)
      texels.push_back({lo, hi, 0, 0});
    else
      texels.back().z = lo, texels.back().w = hi;
    ++count;
  }
}

/// Returns the texels of all levels of an image.
std::uint64_t texels_of(std::uint64_t width, std::uint64_t height) {
  std::uint64_t texels = width * height;
  while (width > 1 || height > 1) {
    width = std::max<std::uint64_t>(1, width / 2);
    height = std::max<std::uint64_t>(1, height / 2);
    texels += width * height;
  }
  return texels;
}

/// Checks that the textures fit, and makes room for them. Two copies of all are held, for the device too, and one image
/// with all its levels in float.
void reserve_texels(const Scene& scene, std::vector<glm::uvec4>& texels) {
  constexpr std::uint64_t kTexel = sizeof(glm::uvec4) / 2;
  std::uint64_t count = 0, largest = 0;
  for (const TextureImage& image : scene.images) {
    const std::uint64_t one = texels_of(image.width, image.height);
    count += one;
    largest = std::max(largest, one);
  }
  const std::string what = fmt::format("{}: {} textures of {} texels", scene.name, scene.images.size(), count);
  if (count > std::numeric_limits<std::uint32_t>::max())
    fail(Failure::Work, "{}; expected less than 2^32 texels; make the images smaller", what);
  need_memory(2 * count * kTexel + largest * sizeof(glm::vec4), what);
  texels.reserve(std::size_t(count / 2 + 1));
}

}  // namespace

PackedTextures pack_textures(const Scene& scene) {
  PackedTextures packed;
  reserve_texels(scene, packed.texels);
  std::vector<PackedImage> images;
  std::uint32_t count = 0;
  for (std::size_t i = 0; i < scene.images.size(); ++i) {
    const std::vector<MipLevel> levels = mip_chain(scene.images[i], gives_alpha(scene, i));
    images.push_back({count, std::uint32_t(levels.size()), glm::vec3(levels.back().texels[0])});
    for (const MipLevel& level : levels) append(level, packed.texels, count);
  }
  for (const Texture& t : scene.textures) {
    const TextureImage& image = scene.images[t.image];
    packed.table.push_back({images[t.image].first, image.width, image.height, images[t.image].levels,
                            std::uint32_t(t.wrap_u) | std::uint32_t(t.wrap_v) << TEXTURE_WRAP_V_SHIFT |
                                (t.nearest ? TEXTURE_NEAREST : 0u)});
    packed.means.push_back(images[t.image].mean);
  }
  return packed;
}

std::vector<glm::uvec4> pack_uvs(const Scene& scene) {
  std::vector<glm::uvec4> texels;
  for (const auto& set : scene.uvs)
    for (const std::array<glm::vec2, 3>& uv : set) {
      texels.push_back({word(uv[0].x), word(uv[0].y), word(uv[1].x), word(uv[1].y)});
      texels.push_back({word(uv[2].x), word(uv[2].y), 0, 0});
    }
  return texels;
}

std::vector<glm::uvec4> pack_colors(const Scene& scene) {
  std::vector<glm::uvec4> texels;
  texels.reserve(2 * scene.colors.size());
  for (const std::array<glm::vec4, 3>& c : scene.colors) {
    const auto rg = [&](std::size_t k) { return glm::packHalf2x16({c[k].r, c[k].g}); };
    const auto ba = [&](std::size_t k) { return glm::packHalf2x16({c[k].b, c[k].a}); };
    texels.push_back({rg(0), ba(0), rg(1), ba(1)});
    texels.push_back({rg(2), ba(2), 0, 0});
  }
  return texels;
}

std::vector<GpuTextureUse> pack_uses(const Scene& scene) {
  std::array<std::uint32_t, kUvSets> first{};
  for (std::size_t set = 1; set < kUvSets; ++set)
    first[set] = first[set - 1] + 2 * std::uint32_t(scene.uvs[set - 1].size());
  std::vector<GpuTextureUse> uses;
  for (const Material& m : scene.materials)
    for (const TextureUse* use : m.uses())
      uses.push_back({use->texture, first[use->set], use->row_u, use->row_v, m.normal_scale});
  return uses;
}

}  // namespace ballot
