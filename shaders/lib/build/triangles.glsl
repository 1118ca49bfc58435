// What the tree is built over, as the builder reads it: the triangles of the scene or, with BALLOT_BOXES, the boxes of
// its instances.
#ifdef BALLOT_BOXES
#include "instance_boxes.glsl"
#else
layout(set = 0, binding = BIND_BUILD_TRIANGLES, scalar) readonly buffer Triangles { vec3 vertices[]; };

struct Corners {
  vec3 a, b, c;
};

Corners corners_of(uint prim) {
  return Corners(vertices[3u * prim], vertices[3u * prim + 1u], vertices[3u * prim + 2u]);
}

vec3 lo_of(Corners t) { return min(t.a, min(t.b, t.c)); }
vec3 hi_of(Corners t) { return max(t.a, max(t.b, t.c)); }
// What nodes keep the largest of below them.
vec3 sides_of_corners(Corners t) { return hi_of(t) - lo_of(t); }

// True if the triangle has no area, as is_degenerate() of engine/bvh/clip.cpp tells. On a device without float64 the
// host gives triangles without area two equal vertices (engine/tree/build/device_builder.cpp).
bool has_no_area(Corners t) {
  if (t.a == t.b || t.b == t.c || t.c == t.a) return true;
#if BALLOT_FLOAT64
  precise dvec3 e = dvec3(t.b) - dvec3(t.a), f = dvec3(t.c) - dvec3(t.a);
  precise dvec3 n = e.yzx * f.zxy - f.yzx * e.zxy;
  return n == dvec3(0.0);
#else
  return false;
#endif
}
#endif
