// The digest that identifies a scene.
#pragma once

#include <cstdint>

#include "engine/model/scene.h"

namespace ballot {

/// Returns a 64-bit hash of everything that a picture of the scene depends on, except views and names. Different scenes
/// have different digests, unless they collide by chance.
std::uint64_t digest_of(const Scene& scene);

}  // namespace ballot
