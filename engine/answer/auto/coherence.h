// The ray class of the caller's own rays, for which the query names no class.
#pragma once

#include <span>
#include <string_view>

#include "shaders/shared/layout.h"

namespace ballot {

/// Returns the class of rays, "coherent", "mixed" or "incoherent", by the share of runs of 64 neighbours whose
/// directions agree in every sign: at least 0.9, at least 0.4, or less. Dead rays do not count, and a run without a
/// live ray agrees.
std::string_view ray_class_of(std::span<const Ray> rays);

}  // namespace ballot
