// The numeric modes: the arithmetic of boxes and triangles. A mode is a line in engine/answer/numeric.h that names a
// triangle test, a box test and a leaf format. Each of the tests is one file.
//
// A triangle test (lib/numeric/triangle_*.glsl) defines
//   RaySpace                           the constants of a ray, and what the test keeps of the nearest hit
//   make_ray_space(inout ray, given) -> RaySpace     ray is scaled, as everywhere else here; given is not
//                                      (lib/numeric/ray_scale.glsl). A test may move the ray's origin along it
//                                      (lib/numeric/nearer_origin.glsl); called before make_slabs()
//   texel_order(space) -> uint         the order in which the test reads a triangle's texels, see order_to(). If leaves
//                                      hold vertices, the texel of the ray's main axis comes last. Or AS_STORED
//   hit_triangle(ray, inout space, triangle, out t, out u, out v) -> bool
//                                      tests a triangle, given by its texels in that order, for any t; NaN counts as no
//                                      hit
//   triangle_place(triangle, block, i) -> uint     the prim of a hit on the i-th triangle of a leaf's block, or a place
//                                      where the prim is found; it stands in Hit::prim until the hit is written
//   prim_at(place) -> uint             returns the prim of a place; NO_HIT for NO_HIT
//   may_count(space, t, ray, best) -> bool         true if the hit that was just found lies in the ray's range and may
//                                      be nearer than the best so far
//   nearer(inout space, t, place, best) -> bool    true if it is nearer: by t, and by prim where t is equal
//   reach(space, best) -> float        returns a t that the nearest hit is surely not beyond; what lies behind it is
//                                      culled
// and, if it defines TRIANGLE_SETTLES,
//   settle_leaf(inout space, inout best)          called after the triangles of a leaf, for a test that decides nothing
//                                      earlier. Finds the nearest hit, with t in the given ray's units; best.prim is
//                                      the prim, not a place
//   change_ray()                       called where a lane that has several rays goes on with another one
//   is_open(space, best) -> bool       true if a triangle that the test has left open may be the nearest hit
//   open_from(space) -> float          returns a t before which no such triangle is hit, to one ulp
//
// A box test (lib/numeric/box_*.glsl) defines
//   Slabs                              the constants of a ray
//   make_slabs(ray) -> Slabs
//   box_interval(slabs, lo, hi, t_min, t_max) -> vec2
//                                      returns the interval [entry, exit] in which the ray is inside, cut to [t_min,
//                                      t_max]; empty if entry > exit
//   centred_interval(slabs, centre, extent, t_min, t_max) -> vec2      the same by centre and half extents
//   slab_origins(slabs, ray, out lo, out hi)     the origins that lower and upper planes are measured from, for bounds
//                                      of packets; mirrored if the slabs are
//   segment_pad(ray) -> vec3           returns the padding with which the box of a ray's segment holds all that the ray
//                                      hits
//   slabs.inv                          the reciprocal direction
// and, except for BOX_WIDENED, which is not offered with the methods that need these,
//   mirrored(slabs, down) -> Slabs     returns the slabs of the ray mirrored along the axes along which it goes down
//   forward_interval(slabs, lo, hi, t_min, t_max) -> vec2      box_interval() of mirrored slabs and a mirrored box,
//                                      whose lower planes come first
//   first_planes(slabs, at, step, out near, out far)   t at the planes through a corner of a grid of 255 steps, as
//                                      entries and as exits; add steps, which are multiples of `step`. Only for layouts
//                                      from LAYOUT_CENTRED on
//   stretched_end(end) -> float        returns the end of an interval of bounds of many rays or of children in a grid,
//                                      stretched by what the test rounds
// and, for BOX_PADDED and BOX_WIDENED,
//   has_slabs(slabs) -> bool           false for a ray from so far away that its slabs meet every box
#include "box.glsl"
#include "ray_scale.glsl"

// The texels of a triangle in the leaf array, and the place of the first.
struct TriangleTexels {
  uvec4 a, b, c;
  uint at;
};

// Returns the order in which a triangle's texels are read, as a word with two bits for each texel: the axes in a
// circle, with `axis` last. Speed-up when a ray keeps this word instead of its axis, on an H200 (580.159.04),
// `watertight`: while-while 1.03, dynamic-fetch 1.01, frontier 1.005.
uint order_to(uint axis) { return 9u << axis; }
uint last_of(uint order) { return order >> 4; }
const uint AS_STORED = 36u;  // order_to(2u)

TriangleTexels fetch_triangle(uint texel, uint order) {
  uint first = order & 3u, second = order >> 2 & 3u;
  return TriangleTexels(leaf_texel(texel + first), leaf_texel(texel + second), leaf_texel(texel + last_of(order)),
                        texel);
}

#if BALLOT_BOX == BOX_PADDED
#include "box_padded.glsl"
#elif BALLOT_BOX == BOX_RELATIVE
#include "box_relative.glsl"
#elif BALLOT_BOX == BOX_WIDENED
#include "box_widened.glsl"
#elif BALLOT_BOX == BOX_FMA
#include "box_fma.glsl"
#else
#include "box_slabs.glsl"
#endif

#if BALLOT_TRIANGLE == TRIANGLE_WATERTIGHT
#include "triangle_watertight.glsl"
#elif BALLOT_TRIANGLE == TRIANGLE_WOOP_AFFINE
#include "triangle_woop_affine.glsl"
#elif BALLOT_TRIANGLE == TRIANGLE_EXACT
#include "triangle_exact.glsl"
#elif BALLOT_TRIANGLE == TRIANGLE_DOUBLE
#include "triangle_double.glsl"
#else
#include "triangle_moeller.glsl"
#endif
