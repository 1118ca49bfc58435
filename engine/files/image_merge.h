// Merges the parts of a picture.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "engine/files/image.h"

namespace ballot {

/// A part of a picture, and the file that it came from, for errors.
struct ImagePart {
  std::filesystem::path file;
  Image image;
};

/// Returns the picture that the parts make up, by tiles of `tile` x `tile` pixels. Attribute "part" of a part is "i/n".
/// Tile k of the whole picture, row by row, comes from part k mod n. Values are copied, not computed. The attributes
/// are those of the first part, without "part"; "seconds" is the sum over all parts.
/// Throws Error(Arguments) if a part is missing, occurs twice, or belongs to another picture: the error names the file
/// and the attribute.
Image merge_parts(const std::vector<ImagePart>& parts, std::uint32_t tile);

}  // namespace ballot
