// Named sets of triangles on which every builder, and every refit, is held to sound trees.
#pragma once

#include "tests/cpu/shapes.h"

namespace ballot::tree_shapes {

using shapes::Triangles;

/// Triangles in a geometric series of sizes: their tree is a chain.
inline Triangles series() {
  Triangles triangles;
  for (float x = 1e-12f; x < 1e11f; x *= 1.05f) triangles.push_back({{{x, 0, 0}, {x, x, 0}, {x, 0, x}}});
  return triangles;
}

/// Triangles whose vertices are close to the largest coordinates there may be.
inline Triangles huge() {
  Triangles triangles = shapes::soup(300, 0.3f);
  for (Triangle& t : triangles)
    for (glm::vec3& v : t) v *= 7e11f;
  return triangles;
}

/// Triangles far from zero, along one line.
inline Triangles on_a_line() {
  Triangles triangles;
  for (int i = 0; i < 1000; ++i) {
    const float x = 5000.f + float(i % 250) * 0.01f;
    triangles.push_back({{{x, 7000, 0}, {x + 0.005f, 7000, 0}, {x, 7000, 0.001f}}});
  }
  return triangles;
}

/// Triangles with others between them that have no area.
inline Triangles with_degenerate() {
  Triangles triangles = shapes::soup(700, 0.3f);
  for (std::size_t i = 0; i < triangles.size(); i += 3) triangles[i][i % 2] = triangles[i][2];
  triangles[20] = {{{0, 0, 0}, {1, 1, 1}, {3, 3, 3}}};
  triangles[22] = {{{9, 9, 9}, {9, 9, 9}, {9, 9, 9}}};
  return triangles;
}

struct TreeShape {
  const char* name;
  Triangles (*make)();
};

inline const TreeShape kTreeShapes[] = {
    {"none", [] { return Triangles{}; }},
    {"only degenerate", [] { return Triangles(9, Triangle{}); }},
    {"one", [] { return shapes::soup(1, 1); }},
    {"two", [] { return shapes::soup(2, 1); }},
    {"six", [] { return shapes::soup(6, 1); }},
    {"seven", [] { return shapes::soup(7, 1); }},
    {"seventeen", [] { return shapes::soup(17, 1); }},
    {"identical", [] { return shapes::identical(1000); }},
    {"coplanar", [] { return shapes::coplanar(500); }},
    {"on a line", on_a_line},
    {"slivers", [] { return shapes::slivers(500); }},
    {"huge and tiny", [] { return shapes::huge_and_tiny(1000); }},
    {"same centroid", [] { return shapes::same_centroid(500); }},
    {"series", series},
    {"huge", huge},
    {"with degenerate", with_degenerate},
    {"soup", [] { return shapes::soup(3001, 0.1f); }},
    {"sphere", [] { return shapes::sphere(4); }},
};

}  // namespace ballot::tree_shapes
