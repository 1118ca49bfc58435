// What the tests of formats that are made of the pair tree share.
#pragma once

#include "engine/tree/formats/pair.h"
#include "engine/tree/host/build.h"
#include "tests/cpu/shapes.h"

namespace ballot {

/// Returns the pair tree of triangles, built without spatial splits.
inline PairTree binary_of(const shapes::Triangles& triangles) {
  return encode_pairs(build_bvh(triangles, {.split_budget = 0}), triangles, NodeLayout::Interleaved);
}

/// Returns the triangles scaled along each axis, and then moved.
inline shapes::Triangles scaled(shapes::Triangles triangles, glm::vec3 by, glm::vec3 to = glm::vec3(0)) {
  for (Triangle& t : triangles)
    for (glm::vec3& v : t) v = v * by + to;
  return triangles;
}

}  // namespace ballot
