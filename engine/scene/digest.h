// What tells scenes apart.
#pragma once

#include <cstdint>

#include "engine/scene/scene.h"

namespace ballot {

/// Of everything that a picture of the scene depends on, but for views and names: scenes that differ have different ones, but
/// for chance.
std::uint64_t digest_of(const Scene& scene);

}  // namespace ballot
