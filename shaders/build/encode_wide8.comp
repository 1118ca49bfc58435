#version 460
#extension GL_GOOGLE_include_directive : require
// Writes the nodes of the eight-wide tree (shared/layout.h), as engine/tree/formats/wide8.cpp does.
#define BALLOT_WIDTH WIDE8_CHILDREN
#include "../lib/build/encode.glsl"

void encode(uint node, uint pair) {
  uint at = node * WIDE8_NODE_TEXELS, next = starts[pair].x + 1u;
  for (uint i = 0u; i < WIDE8_CHILDREN; ++i) {
    Child c = Child(vec3(3.402823466e38), vec3(-3.402823466e38), END_OF_TREE);
    if (i < member_count) {
      c = child_of(members[i]);
      if (c.ref < LEAF_BIT) c.ref = next++;
    }
    texels[at + i] = uvec4(floatBitsToUint(c.lo), c.ref);
    texels[at + WIDE8_CHILDREN + i] = uvec4(floatBitsToUint(c.hi), 0u);
  }
}
