// Generated scenes that are hard on the origins of secondary rays, of any size at any place.
#pragma once

#include <span>
#include <string_view>

#include "engine/ballot.h"

namespace ballot::verify {

struct OriginScene {
  std::string_view name;
  std::string_view what;
  /// Of extent `size` about a point `distance` sizes off the origin, with views of it. Vertices are rounded to float32.
  Scene (*make)(double size, double distance);
};

std::span<const OriginScene> origin_scenes();

}  // namespace ballot::verify
