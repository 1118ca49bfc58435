#version 460
#extension GL_GOOGLE_include_directive : require
// Writes the nodes of the compressed eight-wide tree and the lists of their leaves (shared/layout.h), as
// engine/tree/formats/bvh8.cpp does.
#define BALLOT_WIDTH BVH8_CHILDREN
#include "../lib/build/encode.glsl"
#include "../shared/grid.h"
layout(set = 0, binding = BIND_BUILD_NEEDS, std430) readonly buffer Slots { uint slots[]; };  // lib/build/slots.glsl

// The children by slots.
vec3 lo[BVH8_CHILDREN], hi[BVH8_CHILDREN];
uint used;  // a bit for each slot with a child

// Returns the planes of an axis. first and step become those of its grid.
uvec4 planes(uint axis, Difference extent, out float first, out float step) {
  float below[BVH8_CHILDREN], above[BVH8_CHILDREN], last;
  bool begun = false;
  for (uint s = 0u; s < BVH8_CHILDREN; ++s) {
    if ((used >> s & 1u) == 0u) continue;
    below[s] = widened_below(lo[s][axis], extent);
    above[s] = widened_above(hi[s][axis], extent);
    first = begun ? min(first, below[s]) : below[s];
    last = begun ? max(last, above[s]) : above[s];
    begun = true;
  }
  step = grid_step(first, last);
  uvec4 bytes = uvec4(0u);
  for (uint s = 0u; s < BVH8_CHILDREN; ++s) {
    bool none = (used >> s & 1u) == 0u;
    uint shift = 8u * (s & 3u), word = s >> 2;
    bytes[word] |= (none ? GRID_STEPS : grid_below(first, step, below[s])) << shift;
    bytes[2u + word] |= (none ? 0u : grid_above(first, step, above[s])) << shift;
  }
  return bytes;
}

// Reads the children and lists the leaves from a texel on. Returns a bit for each slot with a leaf.
uint read_slots(uint pair, uint list, out vec3 all_lo, out vec3 all_hi) {
  uint places = slots[pair], leaves = 0u, listed = 0u;
  uvec4 refs = uvec4(END_OF_TREE);
  bool begun = false;
  used = 0u;
  for (uint s = 0u; s < BVH8_CHILDREN; ++s) {
    uint place = places >> 4u * s & 15u;
    if (place == 0u) continue;
    Child c = child_of(members[place - 1u]);
    lo[s] = c.lo;
    hi[s] = c.hi;
    all_lo = begun ? min(all_lo, c.lo) : c.lo;
    all_hi = begun ? max(all_hi, c.hi) : c.hi;
    begun = true;
    used |= 1u << s;
    if (c.ref < LEAF_BIT) continue;
    leaves |= 1u << s;
    refs[listed & 3u] = c.ref;
    texels[list + (listed++ >> 2)] = refs;
    if ((listed & 3u) == 0u) refs = uvec4(END_OF_TREE);
  }
  return leaves;
}

void encode(uint node, uint pair) {
  uint at = node * BVH8_NODE_TEXELS, list = push.nodes * BVH8_NODE_TEXELS + starts[pair].y;
  vec3 all_lo, all_hi, first, step;
  uint leaves = read_slots(pair, list, all_lo, all_hi);
  for (uint axis = 0u; axis < 3u; ++axis)
    texels[at + 2u + axis] = planes(axis, difference(all_hi[axis], all_lo[axis]), first[axis], step[axis]);
  texels[at] = uvec4(floatBitsToUint(first), starts[pair].x + 1u << 8 | used & ~leaves);
  texels[at + 1u] = uvec4(floatBitsToUint(step), list << 8 | leaves);
}
