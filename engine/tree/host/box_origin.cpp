// The origin that the boxes on the device are measured from.
#include <algorithm>

#include "engine/tree/host/bvh.h"

namespace ballot {

glm::vec3 box_origin(const Bounds& scene) {
  constexpr double kFar = 16;  // in longest sides of the scene; padded_reach() and shear_scale() rely on this value
  const glm::dvec3 sides = glm::dvec3(scene.hi) - glm::dvec3(scene.lo);
  const double longest = std::max({sides.x, sides.y, sides.z});
  glm::vec3 origin(0);
  for (int axis = 0; axis < 3; ++axis) {
    const float lo = scene.lo[axis], hi = scene.hi[axis];
    if (std::max(lo, -hi) > 0 && std::max(lo, -hi) >= kFar * longest) origin[axis] = 0.5f * lo + 0.5f * hi;
  }
  return origin;
}

}  // namespace ballot
