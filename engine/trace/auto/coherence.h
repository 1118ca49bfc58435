// The class of rays that no generator made: how coherent and how long they are.
#pragma once

#include <span>
#include <string>

#include "engine/scene/scene.h"
#include "shaders/shared/layout.h"

namespace ballot {

/// Returns two words. The first is "coherent", "mixed" or "incoherent": the share of runs of 64 neighbours whose
/// directions agree in every sign is at least 0.9, at least 0.4, or less. The second is "long" if the median ray may go
/// farther than a tenth of the diagonal of `scene`, else "short". Dead rays do not count; without live rays the result
/// is "foreign: coherent, long".
std::string ray_class_of(std::span<const Ray> rays, const Bounds& scene);

}  // namespace ballot
