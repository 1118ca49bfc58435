// Tests a ray against the eight children of a node of the compressed eight-wide tree (shared/layout.h).
//
// The bytes of a child's box become floats in one of two ways. As halves, two bytes at a time become the last digits of
// two halves, 1024 + q, which hold them exactly. Halves turn into floats without the integer units, which are what
// bounds this step on a GPU. t at a plane is then a multiply-add:
// (1024 + q) * (step * inv) + (t at first - 1024 * (step * inv)).
// As integers, q itself takes the place of 1024 + q; that is fewer instructions on lavapipe.
//
// What these operations round is covered. With w = 2^-24 and the node's extent e along the axis, a plane moves by
//   6 w e (inv and its product with step, up to 255 steps) + 4.02 w e (halves: the sum of t at first and 1024 steps).
// Children are widened by 2^-20 e = 16 w e before they are rounded outward to the grid (engine/tree/formats/bvh8.h).
// The rest goes with the distance of first or of the plane. Padded by rays it is 7 w M (t at first) + 3 w M (the sums),
// and 33 + 10 is less than the 56 of lib/numeric/box_padded.glsl; lib/numeric/box_relative.glsl counts it itself.
// Padded in the tree it is one w of the distance more than lib/numeric/box_widened.glsl counts, 41 instead of 40, twice
// which is less than the 96 that stretch the interval.
#include "format.glsl"

#if BALLOT_FETCH == FETCH_STORAGE
#define FORMAT_WORD(texel, c) format_texels[FORMAT_AT(texel)][c]
#elif BALLOT_FETCH == FETCH_TEXEL
#define FORMAT_WORD(texel, c) texelFetch(format_texels, int(FORMAT_AT(texel)))[c]
#else
#define FORMAT_WORD(texel, c) TEXEL_AT(push.format_lo, push.format_hi, FORMAT_AT(texel))[c]
#endif

#if BALLOT_UNPACK == UNPACK_HALF
// Returns 1024 + q for each of four bytes q.
vec4 steps_of(uint bytes) {
  vec2 even = unpackHalf2x16(bytes & 0x00FF00FFu | 0x64006400u),
       odd = unpackHalf2x16(bytes >> 8 & 0x00FF00FFu | 0x64006400u);
  return vec4(even.x, odd.x, even.y, odd.y);
}
#else
// Returns the four bytes.
vec4 steps_of(uint bytes) {
  return vec4(ivec4(bytes & 255u, bytes >> 8 & 255u, bytes >> 16 & 255u, bytes >> 24));
}
#endif

// t at the planes of a node's children: near and far plus a number of steps times `step`.
struct Bvh8Grid {
  vec3 near, far, step;
};

bool meets_slot(Walker w, Bvh8Grid g, vec3 nearer, vec3 farther, float reach) {
  precise vec3 near = fma(nearer, g.step, g.near), far = fma(farther, g.step, g.far);
#if BALLOT_BOX == BOX_WIDENED || BALLOT_BOX == BOX_RELATIVE
  vec2 i = stretched(near, far, w.ray.t_min, reach);
#else
  vec2 i = cut_axes(near, far, w.ray.t_min, reach);
#endif
  return i.x <= i.y;
}

// Returns a bit for each of four slots whose child the ray meets. The arguments are a byte a slot.
uint meets_slots(Walker w, Bvh8Grid g, uvec3 nearer, uvec3 farther, float reach) {
  vec4 nx = steps_of(nearer.x), ny = steps_of(nearer.y), nz = steps_of(nearer.z);
  vec4 fx = steps_of(farther.x), fy = steps_of(farther.y), fz = steps_of(farther.z);
  return uint(meets_slot(w, g, vec3(nx.x, ny.x, nz.x), vec3(fx.x, fy.x, fz.x), reach)) |
         (meets_slot(w, g, vec3(nx.y, ny.y, nz.y), vec3(fx.y, fy.y, fz.y), reach) ? 2u : 0u) |
         (meets_slot(w, g, vec3(nx.z, ny.z, nz.z), vec3(fx.z, fy.z, fz.z), reach) ? 4u : 0u) |
         (meets_slot(w, g, vec3(nx.w, ny.w, nz.w), vec3(fx.w, fy.w, fz.w), reach) ? 8u : 0u);
}

// Returns the octant of a ray's direction: bits 0, 1 and 2 are set where it goes down along x, y and z. An any-hit ray
// may as well visit the slots in their own order.
uint octant_of(Walker w) {
#if BALLOT_SORTED
  uvec3 down = uvec3(lessThan(w.slabs.inv, vec3(0.0)));
  return down.x | down.y << 1 | down.z << 2;
#else
  return 0u;
#endif
}

// Moves bit s of a byte to bit s XOR octant.
uint turned(uint bits, uint octant) {
#if BALLOT_SORTED
  uint k = octant & 1u;
  bits = bits << k & 0xAAu | bits >> k & 0x55u;
  k = octant & 2u;
  bits = bits << k & 0xCCu | bits >> k & 0x33u;
  k = octant & 4u;
  bits = bits << k & 0xF0u | bits >> k & 0x0Fu;
#endif
  return bits;
}

// Inner nodes or leaves of one parent. `all` is the parent's word `inner` or `leaves`. `hits` has a bit for each that
// is to be visited, in the order of the visits: leaves at their slot, inner nodes at their slot XOR the ray's octant.
struct Bvh8Group {
  uint all, hits;
};

// Takes the first child of a group. Returns its number among all of the group.
uint take_child(inout Bvh8Group g, uint octant) {
  uint slot = uint(findLSB(g.hits)) ^ octant;
  g.hits &= g.hits - 1u;
  return uint(bitCount(g.all & (1u << slot) - 1u));
}

// Takes the nearest inner node of a group. Returns its first texel.
uint take_node(inout Bvh8Group g, uint octant) {
  uint child = take_child(g, octant);
  return ((g.all >> 8) + child) * BVH8_NODE_TEXELS;
}

// Takes a leaf of a group. Returns its reference.
uint take_leaf(inout Bvh8Group g) {
  uint child = take_child(g, 0u);
  return FORMAT_WORD((g.all >> 8) + (child >> 2), child & 3u);
}

// Finds the children of a node that the ray meets.
void meet_children(Walker w, uint node, uint octant, out Bvh8Group inner, out Bvh8Group leaves) {
  uvec4 a = format_texel(node), b = format_texel(node + 1u);
  uvec4 x = format_texel(node + 2u), y = format_texel(node + 3u), z = format_texel(node + 4u);
  bvec3 down = lessThan(w.slabs.inv, vec3(0.0));
  x = down.x ? x.zwxy : x;
  y = down.y ? y.zwxy : y;
  z = down.z ? z.zwxy : z;
  Bvh8Grid g;
  precise vec3 step = uintBitsToFloat(b.xyz) * w.slabs.inv;
  g.step = step;
  first_planes(w.slabs, uintBitsToFloat(a.xyz), step, g.near, g.far);
#if BALLOT_UNPACK == UNPACK_HALF
  precise vec3 near = fma(vec3(-1024.0), step, g.near), far = fma(vec3(-1024.0), step, g.far);
  g.near = near;
  g.far = far;
#endif
  float end = reach(w.space, w.hit);
  uint met = meets_slots(w, g, uvec3(x.x, y.x, z.x), uvec3(x.z, y.z, z.z), end) |
             meets_slots(w, g, uvec3(x.y, y.y, z.y), uvec3(x.w, y.w, z.w), end) << 4;
  inner = Bvh8Group(a.w, turned(met & a.w, octant));
  leaves = Bvh8Group(b.w, met & b.w);
}
