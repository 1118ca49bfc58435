#include "tools/points/field_slice.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/common.hpp>

namespace ballot::cli {

namespace {

constexpr float kLines = 16;  // from zero to the largest distance of the slice

/// Linear colours.
constexpr glm::vec3 kNear(0.95f), kOutside(0.02f, 0.11f, 0.32f), kInside(0.55f, 0.12f, 0.01f), kFar(0.4f);

/// The distances of one slice.
class Plane {
 public:
  Plane(std::span<const float> distances, std::uint32_t side, const FieldSlice& slice)
      : side_(side), values_(std::size_t(side) * side) {
    const std::size_t steps[3] = {1, side, std::size_t(side) * side};
    const std::size_t right = steps[slice.axis == 0 ? 1 : 0], up = steps[slice.axis == 2 ? 1 : 2];
    for (std::uint32_t j = 0; j < side; ++j)
      for (std::uint32_t i = 0; i < side; ++i)
        values_[std::size_t(j) * side + i] = distances[slice.index * steps[slice.axis] + i * right + j * up];
    for (const float d : values_)
      if (std::isfinite(d)) largest_ = std::max(largest_, std::abs(d));
  }

  glm::vec3 color(std::uint32_t i, std::uint32_t j) const {
    const float d = at(i, j);
    if (!std::isfinite(d)) return kFar;
    const float share = largest_ > 0 ? std::abs(d) / largest_ : 0;
    const glm::vec3 color = glm::mix(kNear, d < 0 ? kInside : kOutside, std::sqrt(share));
    bool border = false, line = false;
    for (const float other : {at(std::min(i + 1, side_ - 1), j), at(i, std::min(j + 1, side_ - 1))}) {
      border = border || std::signbit(other) != std::signbit(d);
      line = line || band(other) != band(d);
    }
    return border ? glm::vec3(0) : line ? 0.5f * color : color;
  }

 private:
  float at(std::uint32_t i, std::uint32_t j) const { return values_[std::size_t(j) * side_ + i]; }
  float band(float d) const { return largest_ > 0 ? std::floor(std::abs(d) / largest_ * kLines) : 0; }

  std::uint32_t side_;
  std::vector<float> values_;
  float largest_ = 0;
};

}  // namespace

FieldSlice parse_slice(const std::string& text, std::uint32_t side) {
  const std::size_t axis = std::string("xyz").find(text.empty() ? '?' : text[0]);
  double share = -1;
  const char* end = text.data() + text.size();
  const bool read = text.size() > 2 && text[1] == '=' && std::from_chars(text.data() + 2, end, share).ptr == end;
  if (axis > 2 || !read || !(share >= 0 && share <= 1))
    fail(Failure::Arguments, "--slice {}: expected x, y or z, and a share from 0 to 1, such as z=0.5", text);
  return {int(axis), std::uint32_t(std::lround(share * double(side - 1)))};
}

Image draw_slice(std::span<const float> distances, std::uint32_t side, const FieldSlice& slice) {
  const Plane plane(distances, side, slice);
  Image image{.width = side, .height = side};
  for (int k = 0; k < 3; ++k) {
    Channel channel;
    channel.name = std::string(1, "RGB"[k]);
    channel.floats.reserve(std::size_t(side) * side);
    image.channels.push_back(std::move(channel));
  }
  for (std::uint32_t row = 0; row < side; ++row)
    for (std::uint32_t i = 0; i < side; ++i) {
      const glm::vec3 color = plane.color(i, side - 1 - row);
      for (int k = 0; k < 3; ++k) image.channels[std::size_t(k)].floats.push_back(color[k]);
    }
  return image;
}

}  // namespace ballot::cli
