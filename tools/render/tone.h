// The options of `ballot render` that say how many samples a pixel gets, and how its PNG shows them.
#pragma once

#include <optional>
#include <string>

#include "tools/program/cli.h"

namespace ballot::cli {

struct ToneArgs {
  std::optional<std::uint32_t> spp;  // none: what suits the shading
  std::string tone = "auto";
  float exposure = 0;
  std::optional<float> clamp;  // none: what suits the shading

  void add_to(CLI::App& cmd);
  std::uint32_t samples(std::string_view shading) const;
  /// Returns RenderOptions::clamp. Pictures that are compared with a reference are not clamped unless asked for.
  float clamp_for(std::string_view shading, bool compared) const;
  /// Returns the tone mapping of a shading's PNG. Throws Error(Arguments).
  Tone tone_for(std::string_view shading) const;
};

}  // namespace ballot::cli
