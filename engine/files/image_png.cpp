#include <png.h>

#include <algorithm>
#include <cmath>

#include "engine/core/error.h"
#include "engine/core/file.h"
#include "engine/core/parallel.h"
#include "engine/files/image.h"

namespace ballot {
namespace {

// Encodes a value in [0, 1] by IEC 61966-2-1.
std::uint8_t to_srgb8(float c) {
  const float encoded = c <= 0.0031308f ? 12.92f * c : 1.055f * std::pow(c, 1 / 2.4f) - 0.055f;
  return static_cast<std::uint8_t>(std::lround(255 * encoded));
}

}  // namespace

void PngRows::add(const std::filesystem::path& path, const Image& rows, const Tone& tone) {
  const std::size_t pixels = std::size_t{rows.width} * rows.height, first = bytes_.size();
  const std::array<const Channel*, 3> channels{&rows.channel("R"), &rows.channel("G"), &rows.channel("B")};
  for (const Channel* channel : channels)
    if (channel->floats.size() != pixels)
      fail(Failure::Work, "cannot write {}: channel {} has {} values, expected {} x {}", path.string(), channel->name,
           channel->floats.size(), rows.width, rows.height);
  bytes_.reserve(std::size_t{width_} * height_ * 3);
  bytes_.resize(first + 3 * pixels);
  for_chunks(pixels, 1 << 15, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto shown = toned({channels[0]->floats[i], channels[1]->floats[i], channels[2]->floats[i]}, tone);
      for (std::size_t c = 0; c < 3; ++c) bytes_[first + 3 * i + c] = to_srgb8(shown[c]);
    }
  });
}

void PngRows::write(const std::filesystem::path& path, Links links) const {
  const auto write = [&](OutputFile& out) {
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    png.width = width_;
    png.height = height_;
    png.format = PNG_FORMAT_RGB;
    if (png_image_write_to_stdio(&png, out.stream(), 0, bytes_.data(), 0, nullptr) == 0) {
      out.close();  // throws a better message if the disk is the reason
      fail(Failure::Work, "cannot write {}: {}", path.string(), png.message);
    }
  };
  write_atomically(path, write, links);
}

void write_png(const std::filesystem::path& path, const Image& image, const Tone& tone, Links links) {
  PngRows rows(image.width, image.height);
  rows.add(path, image, tone);
  rows.write(path, links);
}

}  // namespace ballot
