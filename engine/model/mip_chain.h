// The mip maps that the device samples.
#pragma once

#include <cstdint>
#include <glm/vec4.hpp>
#include <vector>

#include "engine/model/material.h"

namespace ballot {

/// A level of a mip map: linear RGBA, row by row from the top.
struct MipLevel {
  std::uint32_t width, height;
  std::vector<glm::vec4> texels;
};

/// Returns the mip levels of an image: the image itself, then each level half as large (rounded down, at least 1), down
/// to 1 x 1. Linear values are averaged; an odd last row or column is averaged together with the last pair. With
/// `by_alpha` colours are weighted by alpha, so that transparent texels do not bleed into others.
std::vector<MipLevel> mip_chain(const TextureImage& image, bool by_alpha);

}  // namespace ballot
