// The registry of shadings of primary hits.
#pragma once

#include <string_view>

#include "shaders/shared/render.h"

namespace ballot {

/// A shading of primary hits. Each one is a line of kShadings and a branch of shaders/lib/shade/shade_hit.glsl.
/// Shadings that trace secondary rays are in integrators.h.
struct Shading {
  std::string_view name;
  int value;  // BALLOT_SHADING
  std::string_view summary;
  bool heat = false;  // the colours come from the counters (heat.h)
};
inline constexpr Shading kShadings[] = {
    {"eyelight", SHADING_EYELIGHT, "base colour times the cosine of the angle to the viewer, plus emission"},
    {"albedo", SHADING_ALBEDO, "base colour, without light"},
    {"normals", SHADING_NORMALS, "shading normal as colour, n / 2 + 1/2"},
    {"heat", SHADING_NORMALS, "work of the traversal at each pixel, see --heat; traced by the instrumented kernel",
     true},
};

}  // namespace ballot
