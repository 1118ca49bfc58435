// Parts of a picture put together.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "engine/core/image.h"

namespace ballot {

/// A part of a picture, and the file that it came from, for errors.
struct ImagePart {
  std::filesystem::path file;
  Image image;
};

/// The picture whose tiles of `tile` x `tile` pixels its parts hold: attribute "part" of a part is "i/n", and tile k of the whole
/// picture, row by row, is that of part k mod n. Values are copied, not computed. Attributes are those of the first part, without
/// "part", and "seconds" of all. Throws Error(Arguments) if a part is missing, there twice, or of another picture: the error names
/// the file and the attribute.
Image merge_parts(const std::vector<ImagePart>& parts, std::uint32_t tile);

}  // namespace ballot
