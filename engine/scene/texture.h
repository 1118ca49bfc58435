// Pictures of textures: decoding, and the mip maps that the device samples. Internal to engine/scene but for mip_chain.
#pragma once

#include <cstddef>
#include <filesystem>
#include <glm/vec4.hpp>
#include <span>
#include <string>
#include <vector>

#include "engine/scene/material.h"

namespace ballot {

/// A PNG, JPEG, BMP, GIF or TGA as 8-bit RGBA. `place` names it in errors ("SCENE: image 3 ('bark')"). Throws Error(Work) if it
/// cannot be decoded or is larger than 16384 pixels on a side.
TextureImage decode_image(std::span<const unsigned char> bytes, const std::string& place, bool srgb);

/// A level of a mip map, linear RGBA.
struct MipLevel {
  std::uint32_t width, height;
  std::vector<glm::vec4> texels;
};

/// The picture, then each level half as large (rounded down, at least 1), down to 1 x 1. Averages are of linear values; an odd
/// row or column counts in its last pair. Colours are weighted by alpha where `by_alpha`, so that what is transparent does not
/// bleed.
std::vector<MipLevel> mip_chain(const TextureImage& image, bool by_alpha);

}  // namespace ballot
