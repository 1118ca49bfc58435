// Writes pairs of siblings in the layout BALLOT_LAYOUT, as engine/tree/formats/pair.cpp does. BALLOT_PADDED: with boxes
// that are padded once for all rays.
layout(set = 0, binding = BIND_BUILD_PAIRS, std430) writeonly buffer Pairs { uvec4 pairs[]; };

// A child of a pair: its box, measured from box_origin(), and its child reference.
struct Child {
  vec3 lo, hi;
  uint ref;
};

#include "next.glsl"

#if BALLOT_PADDED
// Widens a box by the bound of lib/numeric/box_widened.glsl, as padded_boxes() of engine/tree/host/padding.cpp does in
// double precision. The factors are larger by 1e-5, which covers the rounding of the sum.
void pad_box(inout vec3 lo, inout vec3 hi, vec3 sides) {
  const float ROUNDING = 1.02 * 5.9604645e-8 * 1.00001, CLAMPED = 2.9103830e-11 * 1.00001;
  vec3 centre = abs(0.5 * (lo + hi)), extent = 0.5 * (hi - lo);
  vec3 moved = mix(vec3(0.0), centre + extent, notEqual(state.origin, vec3(0.0)));
  float longest = max(sides.x, max(sides.y, sides.z));
  vec3 pad = ROUNDING * (18.0 * sides + (31.0 * longest + 2.0 * centre + 3.0 * extent + moved));
  pad += CLAMPED * state.longest;
  precise vec3 down = lo - pad, up = hi + pad;
  lo = next_down(down);
  hi = next_up(up);
}
#endif

#if BALLOT_LAYOUT >= LAYOUT_CENTRED
// Replaces the bounds by centre and half extent. The half extent is rounded up, so that no point of the box is lost.
void centre_box(inout vec3 lo, inout vec3 hi) {
  precise vec3 centre = 0.5 * lo + 0.5 * hi, above = hi - centre, below = centre - lo;
  vec3 extent = max(above, below);
  lo = centre;
  hi = mix(next_up(extent), vec3(0.0), equal(extent, vec3(0.0)));
}
#endif

#if BALLOT_LAYOUT == LAYOUT_COMPACT
// As upper_halves() of engine/tree/formats/pair.cpp.
uvec3 upper_halves(vec3 above, vec3 below) {
  uvec3 low = (floatBitsToUint(below) + 0xFFFFu) >> 16, bits = floatBitsToUint(above), high = bits >> 16;
  high += uvec3(lessThan(high << 16 | low, bits));
  return high << 16 | low;
}
#endif

void write_pair(uint pair, Child l, Child r) {
  uint at = pair * PAIR_TEXELS(BALLOT_LAYOUT);
#if BALLOT_LAYOUT >= LAYOUT_CENTRED
  centre_box(l.lo, l.hi);
  centre_box(r.lo, r.hi);
#endif
  uvec3 a = floatBitsToUint(l.lo), b = floatBitsToUint(l.hi), c = floatBitsToUint(r.lo), d = floatBitsToUint(r.hi);
#if BALLOT_LAYOUT == LAYOUT_PAPER
#define PAPER_COUNT(ref) ((ref) >= LEAF_BIT ? ((ref) >> LEAF_COUNT_SHIFT & 7u) + 1u : 0u)
#define PAPER_FIRST(ref) ((ref) >= LEAF_BIT ? (ref) & LEAF_TEXEL_MASK : (ref))
  pairs[at] = uvec4(a, b.x);
  pairs[at + 1u] = uvec4(b.yz, PAPER_COUNT(l.ref), PAPER_FIRST(l.ref));
  pairs[at + 2u] = uvec4(c, d.x);
  pairs[at + 3u] = uvec4(d.yz, PAPER_COUNT(r.ref), PAPER_FIRST(r.ref));
#elif BALLOT_LAYOUT == LAYOUT_COMPACT
  pairs[at] = uvec4(a, l.ref);
  pairs[at + 1u] = uvec4(c, r.ref);
  pairs[at + 2u] = uvec4(upper_halves(l.hi, r.hi), 0u);
#else
  pairs[at] = uvec4(a.x, b.x, a.y, b.y);
  pairs[at + 1u] = uvec4(c.x, d.x, c.y, d.y);
  pairs[at + 2u] = uvec4(a.z, b.z, c.z, d.z);
  pairs[at + 3u] = uvec4(l.ref, r.ref, 0u, 0u);
#endif
}
