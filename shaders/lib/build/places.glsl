// The places of pairs and leaves in the device tree. Each node that has more triangles than a leaf may hold needs room
// for its own pair of children, for the pairs of the smaller nodes below it, and for the leaves below these and below
// itself. Rooms follow each other in the order of the nodes, which is Morton order.
//
// BALLOT_COLLAPSE: the places of the wide nodes that pairs are collapsed into (collapse.glsl). Each has one place for
// each of its inner children, which lie one behind the other, and texels for the list of its leaves (bvh8).
#include "frame.glsl"

layout(push_constant, scalar) uniform Push { PlacePush push; };
layout(set = 0, binding = BIND_BUILD_COUNTS, std430) buffer Sums { uvec2 sums[]; };

// What a node needs: pairs or inner children, texels of leaves. A block needs less than 2^16 of each.
#ifdef BALLOT_COLLAPSE
layout(set = 0, binding = BIND_BUILD_STATE, scalar) writeonly buffer Totals { CollapseTotals totals; };
uint nodes_to_place() { return push.nodes; }
uvec2 need_of(uint word) { return uvec2(word & 0xFFu, word >> 8 & 0xFFu); }
void store_totals(uvec2 sum) { totals = CollapseTotals(sum.x + 1u, sum.y); }  // the root lies in front of all others
#else
layout(set = 0, binding = BIND_BUILD_STATE, scalar) buffer State { BuildState state; };
uint nodes_to_place() { return state.proper; }
uvec2 need_of(uint word) {
  return uvec2(word & 0xFFu, (word >> 8 & 0xFFu) * LEAF_HEADER_TEXELS + (word >> 16) * TRIANGLE_TEXELS);
}
void store_totals(uvec2 sum) {
  if (sum.x == 0u) return;  // a leaf could hold the whole tree
  state.pairs = sum.x + 1u;  // the pair of the root lies in front of all others
  state.texels = sum.y;
}
#endif
uint packed(uvec2 need) { return need.x | need.y << 16; }
uvec2 unpacked(uint need) { return uvec2(need & 0xFFFFu, need >> 16); }
