// What a scene is made of, in words.
#pragma once

#include <string>

#include "engine/scene/device_scene.h"

namespace ballot::cli {

/// Returns the numbers of triangles and shapes, counted through the instances: "12 triangles, 3 spheres".
std::string pieces_text(const Scene& scene);

}  // namespace ballot::cli
