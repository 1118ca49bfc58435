// The ray class of foreign rays: the caller's own, for which the query names no class.
#pragma once

#include <span>
#include <string>

#include "engine/scene/scene.h"
#include "shaders/shared/layout.h"

namespace ballot {

/// Returns the class of rays, "foreign: coherent, long" for example. They are "coherent", "mixed" or "incoherent" by
/// the share of runs of 64 neighbours whose directions agree in every sign: at least 0.9, at least 0.4, or less. They
/// are "short" if the median length is less than a tenth of the diagonal of `scene`, else "long". Dead rays do not
/// count, and a run without a live ray agrees. If no ray is alive, the class is "foreign: coherent, long".
std::string ray_class_of(std::span<const Ray> rays, const Bounds& scene);

}  // namespace ballot
