#include <png.h>

#include <algorithm>
#include <cmath>

#include "engine/core/error.h"
#include "engine/core/file.h"
#include "engine/core/image.h"

namespace ballot {
namespace {

// Encodes a value in [0, 1] by IEC 61966-2-1.
std::uint8_t to_srgb8(float c) {
  const float encoded = c <= 0.0031308f ? 12.92f * c : 1.055f * std::pow(c, 1 / 2.4f) - 0.055f;
  return static_cast<std::uint8_t>(std::lround(255 * encoded));
}

}  // namespace

void write_png(const std::filesystem::path& path, const Image& image, const Tone& tone) {
  const std::size_t pixels = std::size_t{image.width} * image.height;
  std::vector<std::uint8_t> bytes(3 * pixels);
  const std::array<const Channel*, 3> channels{&image.channel("R"), &image.channel("G"), &image.channel("B")};
  for (const Channel* channel : channels)
    if (channel->floats.size() != pixels)
      fail(Failure::Work, "cannot write {}: channel {} has {} values, expected {} x {}", path.string(), channel->name,
           channel->floats.size(), image.width, image.height);
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto shown = toned({channels[0]->floats[i], channels[1]->floats[i], channels[2]->floats[i]}, tone);
    for (std::size_t c = 0; c < 3; ++c) bytes[3 * i + c] = to_srgb8(shown[c]);
  }
  write_atomically(path, [&](const std::filesystem::path& temporary) {
    OutputFile out(temporary, path);
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    png.width = image.width;
    png.height = image.height;
    png.format = PNG_FORMAT_RGB;
    if (png_image_write_to_stdio(&png, out.stream(), 0, bytes.data(), 0, nullptr) == 0) {
      out.close();  // throws a better message if the disk is the reason
      fail(Failure::Work, "cannot write {}: {}", path.string(), png.message);
    }
    out.close();
  });
}

}  // namespace ballot
