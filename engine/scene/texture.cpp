#include "engine/scene/texture.h"

#include <stb/stb_image.h>
#include <webp/decode.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

#include "engine/core/error.h"
#include "engine/core/memory.h"

namespace ballot {

namespace {

constexpr int kMostPixels = 16384;  // on a side

// Returns the linear value of each sRGB byte, by IEC 61966-2-1.
const std::array<float, 256>& linear_of_srgb() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> t{};
    for (std::size_t i = 0; i < t.size(); ++i) {
      const double c = double(i) / 255;
      t[i] = float(c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4));
    }
    return t;
  }();
  return table;
}

MipLevel first_level(const TextureImage& image) {
  MipLevel level{image.width, image.height, {}};
  level.texels.resize(std::size_t(image.width) * image.height);
  const auto& table = linear_of_srgb();
  for (std::size_t i = 0; i < level.texels.size(); ++i)
    for (int c = 0; c < 4; ++c) {
      const std::uint8_t byte = image.rgba[i * 4 + std::size_t(c)];
      level.texels[i][c] = image.srgb && c < 3 ? table[byte] : float(byte) / 255.0f;
    }
  return level;
}

MipLevel half_of(const MipLevel& from, bool by_alpha) {
  MipLevel to{std::max(1u, from.width / 2), std::max(1u, from.height / 2), {}};
  to.texels.reserve(std::size_t(to.width) * to.height);
  for (std::uint32_t y = 0; y < to.height; ++y)
    for (std::uint32_t x = 0; x < to.width; ++x) {
      const std::uint32_t end_x = x + 1 == to.width ? from.width : 2 * x + 2;
      const std::uint32_t end_y = y + 1 == to.height ? from.height : 2 * y + 2;
      glm::vec4 sum(0), weighted(0);
      float count = 0;
      for (std::uint32_t j = 2 * y; j < end_y; ++j)
        for (std::uint32_t i = 2 * x; i < end_x; ++i) {
          const glm::vec4& t = from.texels[std::size_t(j) * from.width + i];
          sum += t;
          weighted += t * t.a;
          ++count;
        }
      glm::vec4 mean = sum / count;
      if (by_alpha && sum.a > 0) mean = glm::vec4(glm::vec3(weighted) / sum.a, mean.a);
      to.texels.push_back(mean);
    }
  return to;
}

bool is_webp(std::span<const unsigned char> bytes) {
  return bytes.size() >= 12 && std::memcmp(bytes.data(), "RIFF", 4) == 0 &&
         std::memcmp(bytes.data() + 8, "WEBP", 4) == 0;
}

}  // namespace

TextureImage decode_image(std::span<const unsigned char> bytes, const std::string& place, bool srgb) {
  if (bytes.empty()) fail(Failure::Work, "{} is empty; expected a PNG or JPEG", place);
  if (bytes.size() > std::size_t(std::numeric_limits<int>::max()))
    fail(Failure::Work, "{} has {} bytes; expected less than 2 GiB", place, bytes.size());
  const int size = int(bytes.size());
  const bool webp = is_webp(bytes);
  int width = 0, height = 0, channels = 0;
  if (webp ? !WebPGetInfo(bytes.data(), bytes.size(), &width, &height)
           : !stbi_info_from_memory(bytes.data(), size, &width, &height, &channels))
    fail(Failure::Work, "{} cannot be decoded: {}; expected a PNG, JPEG or WebP", place,
         webp ? "bad WebP header" : stbi_failure_reason());
  if (width < 1 || height < 1 || width > kMostPixels || height > kMostPixels)
    fail(Failure::Work, "{} has {} x {} pixels; expected 1 to {} on each side; make it smaller", place, width, height,
         kMostPixels);
  const std::uint64_t decoded = std::uint64_t(width) * std::uint64_t(height) * 4;
  need_memory(3 * decoded,
              fmt::format("{}: an image of {} x {} pixels", place, width, height));  // encoded lines, two copies
  TextureImage image{.name = place, .width = std::uint32_t(width), .height = std::uint32_t(height), .srgb = srgb};
  if (webp) {
    image.rgba.resize(decoded);
    if (!WebPDecodeRGBAInto(bytes.data(), bytes.size(), image.rgba.data(), decoded, 4 * width))
      fail(Failure::Work, "{} cannot be decoded: bad or animated WebP data; export it again", place);
    return image;
  }
  const std::unique_ptr<stbi_uc, void (*)(void*)> pixels(
      stbi_load_from_memory(bytes.data(), size, &width, &height, &channels, 4), stbi_image_free);
  if (!pixels) fail(Failure::Work, "{} cannot be decoded: {}; export it again", place, stbi_failure_reason());
  image.rgba.assign(pixels.get(), pixels.get() + decoded);
  return image;
}

std::vector<MipLevel> mip_chain(const TextureImage& image, bool by_alpha) {
  std::vector<MipLevel> levels{first_level(image)};
  while (levels.back().width > 1 || levels.back().height > 1) levels.push_back(half_of(levels.back(), by_alpha));
  return levels;
}

}  // namespace ballot
