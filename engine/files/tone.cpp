#include "engine/files/tone.h"

#include <algorithm>
#include <cmath>

#include "engine/files/image.h"

namespace ballot {
namespace {

constexpr float kReflection = 0.04f;          // of a dielectric seen from the front
constexpr float kStart = 0.8f - kReflection;  // where compression begins
constexpr float kDesaturation = 0.15f;
constexpr const char *kToneName = "tone", *kExposureName = "exposure", *kNeutralName = "neutral";

std::array<float, 3> neutral(std::array<float, 3> c) {
  const float least = std::min({c[0], c[1], c[2]});
  const float offset = least < 2 * kReflection ? least - least * least / (4 * kReflection) : kReflection;
  for (float& each : c) each -= offset;
  const float peak = std::max({c[0], c[1], c[2]});
  if (peak < kStart) return c;
  const float rest = 1 - kStart, new_peak = 1 - rest * rest / (peak + rest - kStart);
  const float white = 1 - 1 / (kDesaturation * (peak - new_peak) + 1);
  for (float& each : c) each = each * new_peak / peak * (1 - white) + new_peak * white;
  return c;
}

}  // namespace

std::array<float, 3> toned(const std::array<float, 3>& color, const Tone& tone) {
  constexpr float kMost = 1e6f;  // an infinite value would leave no number
  const float scale = std::exp2(tone.exposure);
  std::array<float, 3> c{};
  for (std::size_t i = 0; i < 3; ++i) c[i] = color[i] > 0 ? std::min(color[i] * scale, kMost) : 0.0f;
  if (tone.neutral) c = neutral(c);
  for (float& each : c) each = std::clamp(each, 0.0f, 1.0f);
  return c;
}

void label_tone(Image& image, const Tone& tone) {
  if (tone.neutral) image.attributes[kToneName] = std::string(kNeutralName);
  if (tone.exposure != 0) image.attributes[kExposureName] = tone.exposure;
}

Tone tone_of(const Image& image) {
  Tone tone;
  const auto name = image.attributes.find(kToneName), exposure = image.attributes.find(kExposureName);
  if (name != image.attributes.end())
    if (const auto* text = std::get_if<std::string>(&name->second)) tone.neutral = *text == kNeutralName;
  if (exposure != image.attributes.end())
    if (const auto* stops = std::get_if<float>(&exposure->second)) tone.exposure = *stops;
  return tone;
}

}  // namespace ballot
