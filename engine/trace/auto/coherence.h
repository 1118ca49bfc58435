// Telling what ray class foreign rays are.
#pragma once

#include <span>
#include <string>

#include "engine/scene/scene.h"
#include "shaders/shared/layout.h"

namespace ballot {

/// "coherent", "mixed" or "incoherent", by the share of runs of 64 neighbours whose directions agree in every sign (at
/// least 0.9, 0.4, less), and "long" or "short": whether the median ray may go farther than a tenth of the diagonal of
/// `scene`. Dead rays do not count. "foreign: coherent, long" where there are none alive.
std::string ray_class_of(std::span<const Ray> rays, const Bounds& scene);

}  // namespace ballot
