#include "engine/render/film/heat.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include "engine/core/error.h"
#include "engine/core/registry.h"
#include "engine/core/srgb.h"

namespace ballot {

namespace {

/// Five colours of the map "viridis" (Stefan van der Walt, Nathaniel Smith, A Better Default Colormap for Matplotlib,
/// SciPy 2015). Its lightness grows evenly, so the colour-blind can read it, and it survives print. The colours are
/// sRGB and are interpolated linearly between entries.
constexpr std::array<glm::vec3, 5> kRamp{{{0.267f, 0.005f, 0.329f},
                                          {0.229f, 0.322f, 0.546f},
                                          {0.128f, 0.567f, 0.551f},
                                          {0.369f, 0.789f, 0.383f},
                                          {0.993f, 0.906f, 0.144f}}};

glm::vec3 ramp(float x) {
  const float at = std::clamp(x, 0.0f, 1.0f) * float(kRamp.size() - 1);
  const std::size_t i = std::min(std::size_t(at), kRamp.size() - 2);
  const glm::vec3 c = glm::mix(kRamp[i], kRamp[i + 1], at - float(i));
  return {linear_of(c.r), linear_of(c.g), linear_of(c.b)};
}

Channel& channel_of(Image& image, std::string_view name) {
  for (Channel& c : image.channels)
    if (c.name == name) return c;
  fail(Failure::Arguments, "the picture has no channel {}", name);
}

}  // namespace

std::span<const glm::vec3, 5> heat_ramp() { return kRamp; }

float heat_top_of(std::vector<float> values) {
  const auto at = values.begin() + std::ptrdiff_t(double(values.size() - 1) * 0.995);
  std::nth_element(values.begin(), at, values.end());
  return std::max(*at, 1.0f);
}

float HeatKind::value(const RayStats& s) const {
  if (!ratio()) return float(s.*count);
  std::uint32_t sum = 0;
  for (const Field field : over)
    if (field) sum += s.*field;
  return sum ? float(s.*count) / float(sum) : 0.0f;
}

float HeatKind::fixed_top(std::uint32_t subgroup) const {
  if (!ratio()) return 0;
  return count == &RayStats::lanes ? float(subgroup) : 1.0f;
}

const HeatKind& find_heat(std::string_view name) { return find_named(kHeatKinds, name, "heat map"); }

void add_stats(Image& image, std::span<const RayStats> sums, std::uint32_t spp) {
  for (const HeatKind& kind : kHeatKinds) {
    const float scale = kind.ratio() ? 1.0f : 1.0f / float(spp);
    Channel channel{"stats." + std::string(kind.name), Pixel::Float, {}, {}};
    for (const RayStats& s : sums) channel.floats.push_back(kind.value(s) * scale);
    image.channels.push_back(std::move(channel));
  }
}

float paint_heat_of(Image& image, const HeatKind& kind, std::uint32_t subgroup) {
  const float top = kind.ratio() ? kind.fixed_top(subgroup)
                                 : heat_top_of(channel_of(image, "stats." + std::string(kind.name)).floats);
  paint_heat(image, kind, top);
  return top;
}

void paint_heat(Image& image, const HeatKind& kind, float top) {
  const std::vector<float>& values = channel_of(image, "stats." + std::string(kind.name)).floats;
  Channel *const red = &channel_of(image, "R"), *const green = &channel_of(image, "G"),
                 *const blue = &channel_of(image, "B"), *const alpha = &channel_of(image, "A");
  for (std::size_t i = 0; i < values.size(); ++i) {
    const glm::vec3 c = ramp(values[i] / top);
    red->floats[i] = c.r;
    green->floats[i] = c.g;
    blue->floats[i] = c.b;
    alpha->floats[i] = 1;
  }
}

}  // namespace ballot
