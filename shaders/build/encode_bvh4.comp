#version 460
#extension GL_GOOGLE_include_directive : require
// Writes the nodes of the four-wide tree (shared/layout.h), as engine/tree/formats/bvh4.cpp does.
#define BALLOT_WIDTH BVH4_CHILDREN
#include "../lib/build/encode.glsl"
#include "../shared/grid.h"

void encode(uint node, uint pair) {
  uint next = starts[pair].x + 1u;
  uvec4 refs = uvec4(END_OF_TREE);
  vec3 lo[BVH4_CHILDREN], hi[BVH4_CHILDREN], first, last;
  for (uint i = 0u; i < member_count; ++i) {
    Child c = child_of(members[i]);
    refs[i] = c.ref < LEAF_BIT ? next++ * BVH4_NODE_TEXELS : c.ref;
    lo[i] = c.lo;
    hi[i] = c.hi;
    first = i == 0u ? c.lo : min(first, c.lo);
    last = i == 0u ? c.hi : max(last, c.hi);
  }
  vec3 step;
  uvec3 lower = uvec3(0u), upper = uvec3(0u);
  for (uint axis = 0u; axis < 3u; ++axis) {
    step[axis] = grid_step(first[axis], last[axis]);
    for (uint i = 0u; i < BVH4_CHILDREN; ++i) {
      bool none = i >= member_count;
      lower[axis] |= (none ? GRID_STEPS : grid_below(first[axis], step[axis], lo[i][axis])) << 8u * i;
      upper[axis] |= (none ? 0u : grid_above(first[axis], step[axis], hi[i][axis])) << 8u * i;
    }
  }
  uint at = node * BVH4_NODE_TEXELS;
  texels[at] = uvec4(floatBitsToUint(first), floatBitsToUint(step.x));
  texels[at + 1u] = uvec4(lower, floatBitsToUint(step.y));
  texels[at + 2u] = uvec4(upper, floatBitsToUint(step.z));
  texels[at + 3u] = refs;
}
