// Generated scenes, of any size and at any position, on which the origins of secondary rays are hard to choose.
#pragma once

#include <span>
#include <string_view>

#include "engine/scene/device_scene.h"

namespace ballot::verify {

struct OriginScene {
  std::string_view name;
  std::string_view what;
  /// Makes the scene, with its views. Its extent is `size` in scene units, and its centre is `distance` times `size`
  /// away from the origin. Vertices are rounded to float32.
  Scene (*make)(double size, double distance);
};

std::span<const OriginScene> origin_scenes();

}  // namespace ballot::verify
