// Box test "padded": subtract, then multiply, with planes moved outwards by a bound of all rounding errors, so that no
// box culls a triangle that the watertight test accepts.
//
// After: Thiago Ize. Robust BVH Ray Traversal. JCGT 2(2), 2013. Differs: there the interval's exit is scaled by 1 + 2
// gamma_3, which covers the box test's own rounding. Here the triangle test's error is covered too. That error is
// absolute, so the planes move.
//
// The test is monotone. Every step rounds, and rounding is monotone, so a box inside another one gets an interval
// inside the other's, exactly. The padding is part of the origins, computed once a ray: (lo - (o + e)) * inv and
// (hi - (o - e)) * inv.
//
// The bound. Let M be at least |p - o| on every axis for all p in the scene, and w = 2^-24; all errors are to first
// order. The triangle test (lib/numeric/triangle_watertight.glsl) decides exactly on a triangle whose vertices are
// moved by at most 11 w M across the ray's main axis (after the shear) and 7 w M along it. It finds t of the point
// where the ray meets that moved triangle to within 15 w M over the main component of the direction. The point q of the
// unmoved triangle with the same weights then lies, on each axis, within 11 + 7 + 15 = 33 w M of the point at t on the
// ray, because the shear's factors are at most 1, and so is any component of the direction over the main one. q lies in
// some leaf's box, because leaves cover their triangles.
//
// The slab test moves a plane by w M (subtraction) + 5 w M (division, 2.5 ulp: Vulkan, "Precision and operation of
// SPIR-V instructions") + w M (product). The sum is 40 w M; 48 w M leave room for terms of second order, M's own
// rounding and the clamp of small directions (box.glsl, 2^-59 M). If boxes are measured from a point other than zero, o
// is rounded by w |o|, and o -+ e by w |o -+ e|; 2 w |o| and the room cover both. Hence the entry of that box, and of
// every box around it, is at most t: whatever the walk met before, it reaches the leaf unless it has a hit nearer than
// t. So hits depend neither on the order of the walk nor on the tree.
//
// Boxes by centre and half extents. The slab test moves a plane by 7 w M (the centre) + 7 w M (half the extent, at most
// M) + w M (their sum): 33 + 15 = 48. They are padded by 64 w M, and by 2 w |o| for boxes by their bounds, which are
// tested too. On the grid of a node of the four-wide tree (lib/tree/bvh4.glsl), whose boxes hold their children
// exactly, the test moves a plane by 7 w M (the grid's origin) + 14 w M (the steps, at most 2 M together, of 7
// roundings) + 2 w M (their sum, and the sum with the padding): 33 + 23 = 56.

#include "padded_slabs.glsl"

// Returns the padding on each side of the box of all points between t_min and t_max of a ray, so that the box holds
// everything that the ray hits. q lies within 33 w M of such a point, see above, and the ends of the segment are
// rounded.
vec3 segment_pad(Ray ray) {
  vec3 ends = abs(from_box_origin(ray.origin)) + abs(ray.t_max * ray.dir);
  return vec3(2.87e-6 * scene_reach(ray.origin)) + 2.4e-7 * ends;
}

vec2 box_interval(Slabs s, vec3 lo, vec3 hi, float t_min, float t_max) {
  vec3 a, b;
  plane_distances(s, lo, hi, a, b);
  return cut_interval(a, b, t_min, t_max);
}

// Slabs that meet every box, at t_min.
const uint INFINITY_BITS = 0x7F800000u;
#define PAD_OF_ALL uintBitsToFloat(INFINITY_BITS)
#if BALLOT_LAYOUT >= LAYOUT_CENTRED
Slabs slabs_of_every_box() { return Slabs(vec3(0.0), vec3(1.0), PAD_OF_ALL); }
bool has_slabs(Slabs s) { return floatBitsToUint(s.pad) != INFINITY_BITS; }
#else
Slabs slabs_of_every_box() { return Slabs(vec3(PAD_OF_ALL), vec3(-PAD_OF_ALL), vec3(1.0)); }
bool has_slabs(Slabs s) { return floatBitsToUint(s.lo_origin.x) != INFINITY_BITS; }
#endif

// A ray from so far away that the padding is larger than the scene: padded boxes then have a part in common, from the
// scene's upper planes moved down to its lower ones moved up. A ray that meets this part meets every box, and no hit
// culls one, as all hits lie in it: the order by distance is of no use. The ray takes boxes as they come, so that lanes
// do not part.
// Rays from 10^6 radii, each of which tests all 32 768 triangles of a sphere, take 68 ms on an idling H200 (580.159.04,
// bvh4) instead of 126.
Slabs make_slabs(Ray ray) {
  vec3 origin = from_box_origin(ray.origin), size = push.scene_hi - push.scene_lo, o = abs(origin);
#if BALLOT_LAYOUT >= LAYOUT_CENTRED
  float pad = 3.82e-6 * scene_reach(ray.origin) + 1.25e-7 * max(o.x, max(o.y, o.z));
  Slabs s = Slabs(origin, reciprocal_direction(ray.dir), pad);
#else
  float pad = 2.87e-6 * scene_reach(ray.origin);
  precise vec3 e = vec3(pad) + 1.25e-7 * o;
  precise vec3 lo_origin = origin + e, hi_origin = origin - e;
  Slabs s = Slabs(lo_origin, hi_origin, reciprocal_direction(ray.dir));
#endif
  if (pad > max(size.x, max(size.y, size.z))) {
    vec2 i = box_interval(s, from_box_origin(push.scene_hi), from_box_origin(push.scene_lo), ray.t_min, ray.t_max);
    if (i.x <= i.y) s = slabs_of_every_box();
  }
  return s;
}

vec2 forward_interval(Slabs s, vec3 lo, vec3 hi, float t_min, float t_max) {
  vec3 a, b;
  plane_distances(s, lo, hi, a, b);
  return cut_axes(a, b, t_min, t_max);
}

#if BALLOT_LAYOUT >= LAYOUT_CENTRED
void first_planes(Slabs s, vec3 at, vec3 step, out vec3 near, out vec3 far) {
  precise vec3 middle = (at - s.origin) * s.inv, pad = s.pad * abs(s.inv);
  near = middle - pad;
  far = middle + pad;
}

vec2 centred_interval(Slabs s, vec3 centre, vec3 extent, float t_min, float t_max) {
  precise vec3 middle = (centre - s.origin) * s.inv, half_way = (extent + s.pad) * abs(s.inv);
  return cut_centred(middle, half_way, t_min, t_max);
}
#endif

float stretched_end(float end) { return end; }
