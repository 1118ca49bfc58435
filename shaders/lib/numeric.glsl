// The numeric modes: the arithmetic of boxes and triangles. A mode is a line in engine/trace/numeric.h that names a triangle
// test, a box test and a leaf format, each of which is one file.
//
// A triangle test (lib/triangle_*.glsl) gives
//   RaySpace                           what is computed once a ray, and what the test keeps of the nearest hit
//   make_ray_space(ray, given) -> RaySpace       ray is scaled, as everywhere here; given is not (lib/scale.glsl)
//   hit_triangle(ray, inout space, triangle, out t, out u, out v) -> bool
//                                      a triangle by its texels, any t; NaN counts as no hit
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
//                                      left a loop early (lib/main.glsl). best.prim is the prim, not a place
// and where it defines TRIANGLE_TURNS, for packets whose rays have one main axis,
//   main_axis(space) -> uint           0 to 2, of a ray
//   turned(triangle, axis) -> triangle
//   hit_turned(ray, inout space, triangle, out t, out u, out v) -> bool      hit_triangle() of a triangle that was turned to
//                                      the ray's main axis
//
// A box test (lib/box_*.glsl) gives
//   Slabs                              what is computed once a ray
//   make_slabs(ray) -> Slabs
//   box_interval(slabs, lo, hi, t_min, t_max) -> vec2
//                                      where the ray is inside, as [entry, exit], cut to [t_min, t_max]; empty if entry > exit
//   centred_interval(slabs, centre, extent, t_min, t_max) -> vec2      the same by centre and half extents
//   slab_origins(slabs, ray, out lo, out hi)     what lower and upper planes are measured from, for bounds of packets
//   first_planes(slabs, at, out near, out far)   t at planes through a corner of a box, as entries and as exits, to be added to
//                                      what a product of the reciprocal direction and a distance from it gives; layouts from
//                                      LAYOUT_CENTRED on
//   segment_pad(ray) -> vec3           what the box of a ray's segment is widened by so that it holds all that the ray hits
//   slabs.inv                          the reciprocal direction
// and with BOX_WIDENED, whose rays from far away have no slabs and meet every box,
//   has_slabs(slabs) -> bool
#include "box.glsl"
#include "scale.glsl"

// What the leaf array holds of a triangle, and where.
struct TriangleTexels {
  uvec4 a, b, c;
  uint at;
};

TriangleTexels fetch_triangle(uint texel) {
  return TriangleTexels(leaf_texel(texel), leaf_texel(texel + 1u), leaf_texel(texel + 2u), texel);
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

#ifndef TRIANGLE_TURNS
uint main_axis(RaySpace space) { return 0u; }
TriangleTexels turned(TriangleTexels triangle, uint axis) { return triangle; }
#define hit_turned hit_triangle
#endif
