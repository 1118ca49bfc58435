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

// True if the triangle has no area, without rounding, as has_no_area() of engine/core/exact_area.h tells, which has the
// bound of the first step and the source of the second. On a device without float64 the host gives triangles without
// area two vertices of equal bits (engine/tree/device/device_builder.cpp).
#if BALLOT_FLOAT64
#include "../numeric/expansion.glsl"
#include "../numeric/float_bits.glsl"

bool sum_is_zero(double terms[6]) {
  expand(terms);
  bool zero = true;
  for (uint i = 0u; i < 6u; ++i) zero = zero && terms[i] == 0.0lf;
  return zero;
}

bool has_no_area(Corners t) {
  precise dvec3 a = widen(t.a), b = widen(t.b), c = widen(t.c), e = b - a, f = c - a;
  precise dvec3 x = e.yzx * f.zxy, y = f.yzx * e.zxy, n = abs(x - y);
  precise dvec3 room = 8.881784197001252e-16lf * (abs(x) + abs(y));
  uint open = any(greaterThan(n, room)) ? 0u : 3u, zeros = 0u;
  for (uint i = 0u; i < open; ++i) {
    precise double terms[6] = double[6](b.x * c.y, -(b.y * c.x), c.x * a.y, -(c.y * a.x), a.x * b.y, -(a.y * b.x));
    zeros += uint(sum_is_zero(terms));
    a = a.yzx, b = b.yzx, c = c.yzx;
  }
  return zeros == 3u;
}
#else
bool is_same(vec3 a, vec3 b) { return floatBitsToUint(a) == floatBitsToUint(b); }

bool has_no_area(Corners t) { return is_same(t.a, t.b) || is_same(t.b, t.c) || is_same(t.c, t.a); }
#endif
#endif
