// Box test "relative": subtract, then multiply, with intervals stretched by a share of themselves. For a triangle test
// that decides exactly, so that a hit lies in some leaf's box, and at its t on the ray, to the last bit. Then the
// rounding of this test is all that has to be covered, and it goes with the distance of a plane. Boxes that are small
// against the scene, and far from its middle or near it, stay small.
//
// After: Thiago Ize. Robust BVH Ray Traversal. JCGT 2(2), 2013. Differs: t may be negative, origins may be off, and
// components of the direction may be clamped (box.glsl).
//
// The bound, with w = 2^-24 and to first order. t at a plane is off by w (subtraction) + 5 w (division, 2.5 ulp:
// Vulkan, "Precision and operation of SPIR-V instructions") + w (product) = 7 w of itself. So the entry of a box that
// holds a hit at t is at most t + 7 w |t|, and its exit at least t - 7 w |t|. The end of the interval is stretched by
// 32 w of itself, more than twice that. So hits depend neither on the order of the walk nor on the tree.
//
// Boxes by centre and half extents e move a plane by 7 w (|plane| + e) + 6 w e + w |plane|: extents grow by 16 w e. On
// the grid of a node whose extent is E, t at the first plane is off by 8 w (|plane| + E), with the sum of the padding,
// the steps by 6 w E, their sum by w |plane|: 9 w |plane| + 14 w E. The eight-wide tree adds 5 w E and 2 w |plane|
// (lib/tree/bvh8.glsl). Planes move outward by 20 w E, which is GRID_PAD steps.
//
// Three errors do not go with the distance, and origins have room for them: 2 w |o| + 2^-58 M + 2^-122, where M is at
// least |p - o| on every axis for all p in the scene. Numbers below 2^-126 may count as zero, by which planes move less
// than 2^-124. An origin that is not as given, because boxes are measured from another point than zero or because it
// was moved along the ray (nearer_origin.glsl), is off by w |o|. Where a component of the direction is clamped, the ray
// moves by less than 2^-59 M. The first term is never lost in the sum with the origin.
//
// Triangle test "double". With w' = 2^-53, a hit at t lies within 33 w' M of its triangle, and has 64 w' M. A ray in
// double is off by w / 2 of its origin and of each component of its direction, and a plane by w / 2 of itself, as its
// vertices are, at most w / 2 (|plane - o| + |o|): t at a plane is off by w of itself more, and w |o| take the rest,
// where o is counted from the scene's zero. If triangles are split among leaves, a leaf's part of one is off by w / 2
// of the vertices' largest coordinate: push.padded_reach, which is 0 otherwise.
#if BALLOT_TRIANGLE != TRIANGLE_DOUBLE
#define ROOM_IN_DOUBLE(ray, m)
#else
#if BALLOT_INSTANCES
#define SPLIT_ROOM whole_push.padded_reach
#else
#define SPLIT_ROOM push.padded_reach
#endif
#define ROOM_IN_DOUBLE(ray, m) + (1.25e-7 * abs((ray).origin) + (7.2e-15 * (m) + SPLIT_ROOM))
#endif
const float END_SLACK = 1.91e-6, BEAM_SLACK = 1.91e-6, EXTENT_SLACK = 9.6e-7, GRID_PAD = 3.1e-4;

#include "padded_slabs.glsl"

// Returns true if M is in bounds. Otherwise every box is entered. On grids, products with clamped directions, which are
// up to 2^60, must stay finite.
#if BALLOT_LAYOUT >= LAYOUT_CENTRED
bool has_safe_slabs(float m) { return m >= 7.89e-31 && m <= 3e19; }
#else
bool has_safe_slabs(float m) { return m >= 7.89e-31 && m <= 8.5e37; }
#endif

Slabs make_slabs(Ray ray) {
  float m = scene_reach(ray.origin), infinity = uintBitsToFloat(0x7F800000u);
  vec3 origin = from_box_origin(ray.origin), inv = reciprocal_direction(ray.dir);
  vec3 room = 1.25e-7 * abs(origin) + (3.47e-18 * m + 1.9e-37) ROOM_IN_DOUBLE(ray, m);
#if BALLOT_LAYOUT >= LAYOUT_CENTRED
  if (!has_safe_slabs(m)) return Slabs(vec3(0.0), vec3(1.0), infinity);
  return Slabs(origin, inv, max(room.x, max(room.y, room.z)));
#else
  if (!has_safe_slabs(m)) return Slabs(vec3(infinity), vec3(-infinity), vec3(1.0));
  precise vec3 lo_origin = origin + room, hi_origin = origin - room;
  return Slabs(lo_origin, hi_origin, inv);
#endif
}

// Returns the padding of a ray segment for the rounding of its ends and of its origin.
vec3 segment_pad(Ray ray) {
  float m = scene_reach(ray.origin);
  if (!has_safe_slabs(m)) return vec3(uintBitsToFloat(0x7F800000u));
  vec3 ends = max(abs(ray.t_min), abs(ray.t_max)) * abs(ray.dir);
  return 4.8e-7 * (abs(from_box_origin(ray.origin)) + ends) + (3.47e-18 * m + 1.9e-37) ROOM_IN_DOUBLE(ray, m);
}

float stretched_end(float end) { return fma(abs(end), END_SLACK, end); }

// Returns the interval with its end stretched.
vec2 stretched(vec3 near, vec3 far, float t_min, float t_max) {
  vec2 i = cut_axes(near, far, t_min, t_max);
  return vec2(i.x, stretched_end(i.y));
}

vec2 box_interval(Slabs s, vec3 lo, vec3 hi, float t_min, float t_max) {
  vec3 a, b;
  plane_distances(s, lo, hi, a, b);
  return stretched(smaller(a, b), larger(a, b), t_min, t_max);
}

vec2 forward_interval(Slabs s, vec3 lo, vec3 hi, float t_min, float t_max) {
  vec3 a, b;
  plane_distances(s, lo, hi, a, b);
  return stretched(a, b, t_min, t_max);
}

#if BALLOT_LAYOUT >= LAYOUT_CENTRED
void first_planes(Slabs s, vec3 at, vec3 step, out vec3 near, out vec3 far) {
  precise vec3 middle = (at - s.origin) * s.inv, pad = fma(abs(step), vec3(GRID_PAD), s.pad * abs(s.inv));
  near = middle - pad;
  far = middle + pad;
}

vec2 centred_interval(Slabs s, vec3 centre, vec3 extent, float t_min, float t_max) {
  precise vec3 middle = (centre - s.origin) * s.inv,
               half_way = fma(extent, vec3(EXTENT_SLACK), extent + s.pad) * abs(s.inv);
  return stretched(middle - half_way, middle + half_way, t_min, t_max);
}
#endif
