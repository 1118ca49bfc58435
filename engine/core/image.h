// Images with named channels: EXR (design: scanline, ZIP) and PNG.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <variant>
#include <vector>

namespace ballot {

enum class Pixel { Half, Float, Uint };  // how an EXR stores a channel

struct Channel {
  std::string name;  // "R", "N.X", "prim", ...
  Pixel type = Pixel::Half;
  std::vector<float> floats;         // width * height values, row by row from the top; for Half and Float
  std::vector<std::uint32_t> uints;  // the same for Uint
};

/// An EXR attribute: text, number, count, or a 4x4 matrix in OpenEXR's row-vector convention, row by row.
using Attribute = std::variant<std::string, float, int, std::array<float, 16>>;

struct Image {
  std::uint32_t width = 0, height = 0;  // of what is here: an EXR's data window
  std::vector<Channel> channels = {};
  std::map<std::string, Attribute> attributes = {};
  std::uint32_t x = 0, y = 0;                     // its top left corner in the whole picture
  std::uint32_t full_width = 0, full_height = 0;  // of the whole picture, the display window; 0: there is no more

  const Channel& channel(const std::string& name) const;  // throws Error(Arguments) that lists the names there are
};

/// Writes atomically. Half values beyond 65504 become 65504. Throws Error(Work).
void write_exr(const std::filesystem::path& path, const Image& image);
/// Reads every channel of a scanline EXR (subsampling refused). Throws Error(Work).
Image read_exr(const std::filesystem::path& path);

/// R, G, B through the sRGB curve to 8 bits, values clamped to [0, 1]; writes atomically. Throws Error(Work).
void write_png(const std::filesystem::path& path, const Image& image);

}  // namespace ballot
