// Reads pairs of siblings in the layout BALLOT_LAYOUT, as engine/tree/formats/pair_decode.h does.
layout(set = 0, binding = BIND_BUILD_PAIRS, std430) readonly buffer Pairs { uvec4 pairs[]; };

// A child of a pair: its box, measured from box_origin(), and its child reference.
struct Child {
  vec3 lo, hi;
  uint ref;
};

#if BALLOT_LAYOUT >= LAYOUT_CENTRED
#include "next.glsl"
// Each sum is rounded, then moved to the next float outward, so the box holds the exact one.
Child child_of_centred(vec3 centre, vec3 extent, uint ref) {
  precise vec3 lo = centre - extent, hi = centre + extent;
  return Child(next_down(lo), next_up(hi), ref);
}
#endif

// Returns a child of the pair that starts at this texel. side: 0 or 1, left or right.
Child read_child(uint texel, uint side) {
#if BALLOT_LAYOUT == LAYOUT_PAPER
  uvec4 a = pairs[texel + 2u * side], b = pairs[texel + 2u * side + 1u];
  uint ref = b.z == 0u ? b.w : LEAF_BIT | (b.z - 1u) << LEAF_COUNT_SHIFT | b.w;
  return Child(uintBitsToFloat(a.xyz), uintBitsToFloat(uvec3(a.w, b.xy)), ref);
#elif BALLOT_LAYOUT == LAYOUT_COMPACT
  uvec4 a = pairs[texel + side], halves = pairs[texel + 2u];
  uvec3 extent = side == 0u ? halves.xyz : halves.xyz << 16;
  return child_of_centred(uintBitsToFloat(a.xyz), uintBitsToFloat(extent), a.w);
#else
  uvec4 xy = pairs[texel + side], z = pairs[texel + 2u], refs = pairs[texel + 3u];
  vec3 a = uintBitsToFloat(uvec3(xy.xz, side == 0u ? z.x : z.z)),
       b = uintBitsToFloat(uvec3(xy.yw, side == 0u ? z.y : z.w));
  uint ref = side == 0u ? refs.x : refs.y;
#if BALLOT_LAYOUT == LAYOUT_CENTRED
  return child_of_centred(a, b, ref);
#else
  return Child(a, b, ref);
#endif
#endif
}
