// Records and bindings that C++ and GLSL share for the queries of shaders/query/: points and crossings.
#ifndef BALLOT_QUERY_H
#define BALLOT_QUERY_H

#include "layout.h"

// The bindings of set 0 that query kernels have in addition to those of layout.h and variant.h.
#define BIND_CROSSINGS 16  // out: a word for each query: crossings of a ray, or whether a point is inside
#define BIND_PLACES 17     // in: where the crossings of a ray go

#ifdef __cplusplus
namespace ballot {
#endif

// A point and how far away the nearest triangle may be. A point with a NaN or infinite component, or a limit that is
// negative or NaN, is dead.
struct ProbePoint {
  vec3 at;      // scene units
  float limit;  // scene units; infinite: none
};
BALLOT_RECORD(ProbePoint, 16);

// The nearest point of a mesh.
struct Nearest {
  vec3 at;         // scene units; 0 without a triangle
  float distance;  // scene units; infinite without a triangle within the limit
  uint prim;       // the triangle's number in the order of the scene file, or NO_HIT
  float u;         // the weights of vertices 1 and 2 of the triangle at that point
  float v;
  uint spare;
};
BALLOT_RECORD(Nearest, 32);

#ifdef __cplusplus
}  // namespace ballot
#endif

#endif  // BALLOT_QUERY_H
