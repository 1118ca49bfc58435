#include "tools/render/tone.h"

#include <cmath>

namespace ballot::cli {

void ToneArgs::add_to(CLI::App& cmd) {
  std::string samples;
  for (const Integrator& i : kIntegrators) samples += fmt::format("{} {}, ", i.name, i.samples);
  cmd.add_option("--spp", spp,
                 fmt::format("samples per pixel, 1 to 65536 [{}others 1, through the pixel's centre]", samples));
  cmd.add_option(
      "--clamp", clamp,
      "largest radiance of a sample of ao, whitted and path: brighter ones are scaled down to it, which removes\n"
      "fireflies and darkens the picture a little; 0: none [path 20, 0 with --reference; others 0]");
  cmd.add_option("--tone", tone,
                 "tone mapping of the PNG: neutral (Khronos PBR Neutral) or none, which cuts off at 1\n"
                 "[auto: neutral for whitted and path]");
  cmd.add_option("--exposure", exposure, "stops, -30 to 30: the PNG's values are multiplied by 2^STOPS before [0]");
}

std::uint32_t ToneArgs::samples(std::string_view shading) const {
  const Integrator* integrator = find_integrator(shading);
  return spp.value_or(integrator ? integrator->samples : 1);
}

float ToneArgs::clamp_for(std::string_view shading, bool compared) const {
  const Integrator* integrator = find_integrator(shading);
  return clamp.value_or(integrator && !compared ? integrator->clamp : 0);
}

Tone ToneArgs::tone_for(std::string_view shading) const {
  if (tone != "auto" && tone != "neutral" && tone != "none")
    fail(Failure::Arguments, "--tone: '{}' is none of auto, neutral, none", tone);
  if (!(std::abs(exposure) <= 30)) fail(Failure::Arguments, "--exposure: {} is not between -30 and 30 stops", exposure);
  const Integrator* integrator = find_integrator(shading);
  const bool lit = integrator && integrator->sees == Sees::Materials;
  return {.neutral = tone == "neutral" || (tone == "auto" && lit), .exposure = exposure};
}

}  // namespace ballot::cli
