// Decodes the images of textures. Internal to engine/files.
#pragma once

#include <span>
#include <string>

#include "engine/model/material.h"

namespace ballot {

/// Decodes a PNG, JPEG, WebP, BMP, GIF or TGA to 8-bit RGBA. `place` names it in errors ("SCENE: image 3 ('bark')").
/// Throws Error(Work) if it cannot be decoded or is larger than 16384 pixels on a side.
TextureImage decode_image(std::span<const unsigned char> bytes, const std::string& place, bool srgb);

}  // namespace ballot
