// The numeric modes: the arithmetic of boxes and triangles. A mode is a line in engine/trace/numeric.h that names a triangle
// test, a box test and a leaf format, each of which is one file.
//
// A triangle test (lib/triangle_*.glsl) gives
//   RaySpace                           what is computed once a ray, and what the test keeps of the nearest hit
//   make_ray_space(ray, given) -> RaySpace       ray is scaled, as everywhere here; given is not (lib/numeric/ray_scale.glsl)
//   texel_order(space) -> uint         in which the test wants a triangle's texels, see order_to(): where leaves hold vertices, that
//                                      of the axis that is z for the ray last; or AS_STORED
//   hit_triangle(ray, inout space, triangle, out t, out u, out v) -> bool
//                                      a triangle by its texels in that order, any t; NaN counts as no hit
//   triangle_place(triangle, block, i) -> uint     what a hit on the i-th triangle of a leaf's block has for prim until it is
//                                      written: the prim, or where it is found
//   prim_at(place) -> uint             the prim; NO_HIT of NO_HIT
//   may_count(space, t, ray, best) -> bool         whether the hit that was just found lies in the ray's range and may be nearer
//                                      than the best so far
//   nearer(inout space, t, place, best) -> bool    whether it is nearer: by t, among equal t by prim
//   reach(space, best) -> float        a t that the nearest hit is surely not beyond; what lies behind it is culled
// and where it defines TRIANGLE_SETTLES
//   settle_leaf(inout space, inout best) -> bool  called after the triangles of a leaf, for a test that decides nothing
//                                      before: finds the nearest hit, with t in the given ray's units. True if the driver
//                                      left a loop early (lib/frame/main.glsl). best.prim is the prim, not a place
//
// A box test (lib/box_*.glsl) gives
//   Slabs                              what is computed once a ray
//   make_slabs(ray) -> Slabs
//   box_interval(slabs, lo, hi, t_min, t_max) -> vec2
//                                      where the ray is inside, as [entry, exit], cut to [t_min, t_max]; empty if entry > exit
//   centred_interval(slabs, centre, extent, t_min, t_max) -> vec2      the same by centre and half extents
//   slab_origins(slabs, ray, out lo, out hi)     what lower and upper planes are measured from, for bounds of packets; mirrored
//                                      if the slabs are
//   segment_pad(ray) -> vec3           what the box of a ray's segment is widened by so that it holds all that the ray hits
//   slabs.inv                          the reciprocal direction
// and, but for BOX_WIDENED, which the methods that need it do not have,
//   mirrored(slabs, down) -> Slabs     of the ray as it looks with these axes turned round: those along which it goes down
//   forward_interval(slabs, lo, hi, t_min, t_max) -> vec2      box_interval() of mirrored slabs and a mirrored box, whose lower
//                                      planes come first
//   first_planes(slabs, at, out near, out far)   t at planes through a corner of a box, as entries and as exits, to be added to
//                                      what a product of the reciprocal direction and a distance from it gives; layouts from
//                                      LAYOUT_CENTRED on
// and with BOX_WIDENED, whose rays from far away have no slabs and meet every box,
//   has_slabs(slabs) -> bool
#include "box.glsl"
#include "ray_scale.glsl"

// What the leaf array holds of a triangle, and where.
struct TriangleTexels {
  uvec4 a, b, c;
  uint at;
};

// The order in which texels are read, each by two bits: in a circle, that of an axis last. Such a word a ray instead of its axis,
// on an H200 (580.159.04), `watertight`: while-while 1.03, dynamic-fetch 1.01, frontier 1.005.
uint order_to(uint axis) { return 9u << axis; }
uint last_of(uint order) { return order >> 4; }
const uint AS_STORED = 36u;  // order_to(2u)

TriangleTexels fetch_triangle(uint texel, uint order) {
  uint first = order & 3u, second = order >> 2 & 3u;
  return TriangleTexels(leaf_texel(texel + first), leaf_texel(texel + second), leaf_texel(texel + last_of(order)), texel);
}

#if BALLOT_BOX == BOX_PADDED
#include "box_padded.glsl"
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
#else
#include "triangle_moeller.glsl"
#endif
