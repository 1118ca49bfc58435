#include "engine/model/mip_chain.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace ballot {

namespace {

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

}  // namespace

std::vector<MipLevel> mip_chain(const TextureImage& image, bool by_alpha) {
  std::vector<MipLevel> levels{first_level(image)};
  while (levels.back().width > 1 || levels.back().height > 1) levels.push_back(half_of(levels.back(), by_alpha));
  return levels;
}

}  // namespace ballot
