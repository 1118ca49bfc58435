// Images with named channels: EXR (design: scanline, ZIP) and PNG.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "engine/core/file.h"
#include "engine/files/tone.h"

namespace ballot {

enum class Pixel { Half, Float, Uint };  // the type of a channel in an EXR

/// A channel of an image. Only one of `floats` and `uints` is used.
struct Channel {
  std::string name;  // "R", "N.X", "prim", ...
  Pixel type = Pixel::Half;
  std::vector<float> floats;         // Half and Float: width * height values, row by row from the top
  std::vector<std::uint32_t> uints;  // Uint: the same
};

/// An EXR attribute: a string, a float, an int, or a 4x4 matrix in OpenEXR's row-vector convention, row by row.
using Attribute = std::variant<std::string, float, int, std::array<float, 16>>;

/// A picture, or the part of one that a data window covers.
struct Image {
  std::uint32_t width = 0, height = 0;  // pixels of this image: an EXR's data window
  std::vector<Channel> channels = {};
  std::map<std::string, Attribute> attributes = {};
  std::uint32_t x = 0, y = 0;                     // position of this image's top left pixel in the whole picture
  std::uint32_t full_width = 0, full_height = 0;  // size of the whole picture, the display window; 0: this image is all

  /// Returns the channel of this name. Throws Error(Arguments) that lists the names of the channels.
  const Channel& channel(const std::string& name) const;
};

/// Writes an EXR atomically (write_atomically). Values of Half channels are clamped to [-65504, 65504]. Throws
/// Error(Work).
void write_exr(const std::filesystem::path& path, const Image& image, Links links = Links::Follow);
/// Writes an EXR whose rows come in bands: `next` returns the rows below those so far, as an image of the same width
/// and channels. `whole` has the size, the attributes, and the channels without values. The file has the bytes that
/// write_exr() gives all rows. Throws as write_exr() and `next` do; also if a band does not fit.
void write_exr_in_bands(const std::filesystem::path& path, const Image& whole, const std::function<Image()>& next,
                        Links links = Links::Follow);
/// Returns the size, the attributes, and the channels without values of an EXR. Throws as read_exr().
Image read_exr_header(const std::filesystem::path& path);
/// Reads every channel of a flat, single-part EXR. Throws Error(Work); subsampled channels are an error, and so are
/// pictures that do not fit into the memory that is left (memory.h).
Image read_exr(const std::filesystem::path& path);
/// Returns a channel of half or float of a picture that was read from `file`. Throws Error(Work), which names the file.
const Channel& channel_in(const std::filesystem::path& file, const Image& image, const std::string& name);

/// Writes the channels R, G, B as an 8-bit PNG, atomically: tone-mapped and sRGB encoded.
/// Throws Error(Work), and Error(Arguments) if a channel is missing.
void write_png(const std::filesystem::path& path, const Image& image, const Tone& tone = {},
               Links links = Links::Follow);

/// The same for a picture whose rows come in bands. It keeps three bytes a pixel.
class PngRows {
 public:
  PngRows(std::uint32_t width, std::uint32_t height) : width_(width), height_(height) {}
  /// Adds the rows of an image below those so far. Throws Error as write_png(), which names `path`.
  void add(const std::filesystem::path& path, const Image& rows, const Tone& tone);
  /// Writes all rows. Throws Error(Work).
  void write(const std::filesystem::path& path, Links links = Links::Follow) const;

 private:
  std::uint32_t width_, height_;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace ballot
