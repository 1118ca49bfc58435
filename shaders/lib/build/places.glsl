// The places of pairs and leaves in the device tree. Each node that has more triangles than a leaf may hold needs room
// for its own pair of children, for the pairs of the smaller nodes below it, and for the leaves below these and below
// itself. Rooms follow each other in the order of the nodes, which is Morton order.
#include "frame.glsl"

layout(push_constant, scalar) uniform Push { PlacePush push; };
layout(set = 0, binding = BIND_BUILD_STATE, scalar) buffer State { BuildState state; };
layout(set = 0, binding = BIND_BUILD_COUNTS, std430) buffer Sums { uvec2 sums[]; };

// What a node needs: pairs, texels of leaves. A block needs less than 2^16 of each.
uvec2 need_of(uint word) {
  return uvec2(word & 0xFFu, (word >> 8 & 0xFFu) * LEAF_HEADER_TEXELS + (word >> 16) * TRIANGLE_TEXELS);
}
uint packed(uvec2 need) { return need.x | need.y << 16; }
uvec2 unpacked(uint need) { return uvec2(need & 0xFFFFu, need >> 16); }
