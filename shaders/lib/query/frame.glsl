// The frame of the point queries: points, boxes against points, and triangles relative to a point. Every kernel of
// shaders/query that asks about points includes this file after lib/frame/kernel.glsl.
//
// A point record is a texel (x, y, z, limit), read through the binding of rays. A point with a component that is NaN or
// infinite is dead: nothing is nearest to it, and it is outside.

// The point of a lane, and what a walk needs of it.
struct Probe {
  vec3 at;       // scene units
  vec3 from;     // at, relative to the point that boxes are measured from
  float scale;   // power of two that brings the reach of the scene into [2^38, 2^39), or 2^126 if that is less
  vec3 scaled;   // at * scale
  float pad;     // scene units: boxes are widened by it
  bool far;      // more than 16 longest sides away from some point of the scene; such points have no padding
};

// 128 * 2^-24. shaders/query/closest_point.comp and shaders/query/inside.comp prove that it is enough.
const float POINT_PAD = 7.6294e-6;
const float FARTHEST = 3.4028234e38;

// Returns the power of two that brings a magnitude into [2^bits, 2^(bits + 1)), or 2^126 if that is less.
float scale_for(float magnitude, uint bits) {
  return uintBitsToFloat(min(254u + bits - clamp(floatBitsToUint(magnitude) >> 23, 1u, 253u), 253u) << 23);
}

// Numbers of scaled vectors are below 2^41, and products of three stay below 2^127. Products of two do not underflow
// for lengths above 2^-63, which are 2^-101 of the reach; the exact sign of a difference of two products
// (lib/numeric/products.glsl) needs 2^-89 of it.
const uint SCALED_BITS = 38u;

Probe make_probe(vec3 at) {
  Probe p;
  vec3 sides = push.scene_hi - push.scene_lo;
  float reach = scene_reach(at);
  p.at = at;
  p.from = from_box_origin(at);
  p.scale = scale_for(reach, SCALED_BITS);
  precise vec3 scaled = at * p.scale;
  p.scaled = scaled;
  p.far = reach > 16.0 * max(sides.x, max(sides.y, sides.z));
  p.pad = p.far ? 0.0 : POINT_PAD * reach;
  return p;
}

// A triangle relative to the probe, and its edges a to b, b to c, c to a; all scaled. Each number is a difference of
// two scaled coordinates, rounded once: products with a power of two are exact.
struct Around {
  vec3 a, b, c;
  vec3 ab, bc, ca;
};

#ifndef CORNERS_OF
#define CORNERS_OF corners_of
#endif
Corners corners_around(Probe p, TriangleTexels triangle) {
  Corners v = CORNERS_OF(triangle);
  precise vec3 a = v.v0 * p.scale - p.scaled, b = v.v1 * p.scale - p.scaled, c = v.v2 * p.scale - p.scaled;
  return Corners(a, b, c);
}

// Returns for each axis how far the probe lies outside of a box that is widened by its padding; 0 within its planes.
vec3 outside_of(Probe p, NodeBox box) {
#if BALLOT_LAYOUT >= LAYOUT_CENTRED
  return larger(abs(box.a - p.from) - (box.b + p.pad), vec3(0.0));
#else
  return larger(larger(box.a - (p.from + p.pad), (p.from - p.pad) - box.b), vec3(0.0));
#endif
}

// The lane's own stack: child references, and a float for each.
#define PROBE_STACK_DECLARE  \
  uint stack[STACK_SIZE];    \
  float stack_near[STACK_SIZE];
