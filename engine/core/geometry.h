// The geometry that every room speaks of: triangles, boxes and transforms.
#pragma once

#include <array>
#include <glm/vec3.hpp>

#include "engine/core/unset.h"

namespace ballot {

using Triangle = std::array<glm::vec3, 3>;  // the vertices, in scene units; 36 bytes
static_assert(sizeof(Triangle) == 36);

/// An axis-aligned box.
struct Bounds {
  glm::vec3 lo{0}, hi{0};
};

/// The transform of an instance: world = m[r][0] x + m[r][1] y + m[r][2] z + m[r][3] for r = 0, 1, 2. Row by row.
struct Transform {
  float m[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
};
static_assert(sizeof(Transform) == 48);

}  // namespace ballot
