#include "engine/files/make_sky.h"

#include <cmath>
#include <cstdlib>

#include "engine/core/error.h"
#include "engine/core/memory.h"
#include "engine/files/image.h"

namespace ballot {

namespace {

constexpr const char* kForms = "none, R,G,B, gradient, gradient:ZENITH:HORIZON:GROUND (each R,G,B), or a FILE.exr";

bool usable(const glm::vec3& c) {
  return std::isfinite(c.x) && std::isfinite(c.y) && std::isfinite(c.z) && c.x >= 0 && c.y >= 0 && c.z >= 0;
}

/// Parses three finite numbers that are not below 0, separated by commas. Returns false for any other text.
bool parse_color(const std::string& text, glm::vec3& color) {
  const char* at = text.c_str();
  for (int i = 0; i < 3; ++i) {
    char* end = nullptr;
    color[i] = std::strtof(at, &end);
    if (end == at || *end != (i < 2 ? ',' : '\0')) return false;
    at = end + 1;
  }
  return usable(color);
}

Sky gradient(const std::string& word) {
  Sky sky{
      .kind = Sky::Kind::Gradient, .zenith = {0.35f, 0.55f, 1.0f}, .horizon = glm::vec3(1), .ground = glm::vec3(0.3f)};
  if (word == "gradient") return sky;
  const std::size_t first = word.find(':') + 1, second = word.find(':', first), third = word.find(':', second + 1);
  if (second == std::string::npos || third == std::string::npos ||
      !parse_color(word.substr(first, second - first), sky.zenith) ||
      !parse_color(word.substr(second + 1, third - second - 1), sky.horizon) ||
      !parse_color(word.substr(third + 1), sky.ground))
    fail(Failure::Arguments, "sky {}: expected three colours of three numbers that are not below 0: {}", word, kForms);
  return sky;
}

Sky read_map(const std::string& path) {
  const Image image = read_exr(path);
  if (image.width != 2 * image.height)
    fail(Failure::Work, "{}: a sky of {} x {} pixels; expected twice as wide as high (longitude by latitude)", path,
         image.width, image.height);
  constexpr std::uint64_t kPixelBytes = 48;  // of a sky here, of the device's, and of the tables that choose its light
  need_memory(kPixelBytes * image.width * image.height,
              fmt::format("{}: a sky of {} x {} pixels", path, image.width, image.height));
  Sky sky{.kind = Sky::Kind::Map, .map_name = path, .width = image.width, .height = image.height};
  const Channel *const red = &channel_in(path, image, "R"), *const green = &channel_in(path, image, "G"),
                       *const blue = &channel_in(path, image, "B");
  sky.map.reserve(red->floats.size());
  for (std::size_t i = 0; i < red->floats.size(); ++i) {
    const glm::vec3 c(red->floats[i], green->floats[i], blue->floats[i]);
    if (!usable(c))
      fail(Failure::Work, "{}: pixel {}, {} is ({}, {}, {}); expected finite radiance not below 0", path,
           i % image.width, i / image.width, c.x, c.y, c.z);
    sky.map.push_back(c);
  }
  return sky;
}

}  // namespace

Sky make_sky(const std::string& word) {
  if (word == "none") return {};
  if (word == "gradient" || word.starts_with("gradient:")) return gradient(word);
  Sky sky{.kind = Sky::Kind::Constant};
  if (parse_color(word, sky.zenith)) return sky;
  if (word.ends_with(".exr")) return read_map(word);
  fail(Failure::Arguments, "sky {}: unknown sky; expected {}", word, kForms);
}

}  // namespace ballot
