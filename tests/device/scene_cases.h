// Named scenes on which methods, and walks of the host, are held to what is true.
#pragma once

#include <ostream>

#include "tests/cpu/shapes.h"

namespace ballot::scene_cases {

struct SceneCase {
  const char* name;
  shapes::Triangles (*make)();
  bool own_kernels = false;  // kernels are compiled for its tree alone
};

inline void PrintTo(const SceneCase& scene, std::ostream* out) { *out << scene.name; }

inline const SceneCase kScenes[] = {
    {"none", [] { return shapes::Triangles{}; }},
    {"one", [] { return shapes::soup(1, 1); }, true},
    {"six", [] { return shapes::soup(6, 1); }},
    {"seven", [] { return shapes::soup(7, 1); }},
    {"identical", [] { return shapes::identical(100); }},
    {"coplanar", [] { return shapes::coplanar(200); }},
    {"soup", [] { return shapes::soup(3000, 0.1f); }},
    {"sphere", [] { return shapes::sphere(5); }, true},
    {"slivers", [] { return shapes::slivers(150); }},
    {"hugeAndTiny", [] { return shapes::huge_and_tiny(400); }},
    {"sameCentroid", [] { return shapes::same_centroid(120); }},
};

}  // namespace ballot::scene_cases
