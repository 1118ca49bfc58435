#version 460
#extension GL_GOOGLE_include_directive : require
// Numbers the wide nodes that pairs are collapsed into (lib/build/collapse.glsl): the inner children of a node lie one
// behind the other, in the order of the children or, with BALLOT_SLOTS, of their slots, which are found here.
#include "../lib/build/frame.glsl"

layout(push_constant, scalar) uniform Push { CollapsePush push; };
layout(set = 0, binding = BIND_BUILD_NEEDS, std430) buffer Needs { uint needs[]; };  // BALLOT_SLOTS: slots from now on
layout(set = 0, binding = BIND_BUILD_STARTS, std430) readonly buffer Starts { uvec2 starts[]; };
layout(set = 0, binding = BIND_BUILD_WIDE_NODES, std430) writeonly buffer WideNodes { uint wide_nodes[]; };
#define BALLOT_LAYOUT LAYOUT_INTERLEAVED
#include "../lib/build/read_pair.glsl"
#include "../lib/build/collapse.glsl"
#include "../lib/build/members.glsl"
#if BALLOT_SLOTS
#include "../lib/build/slots.glsl"
#endif

void main() {
  for (uint pair = gl_GlobalInvocationID.x; pair < push.pairs; pair += gl_NumWorkGroups.x * GROUP_SIZE) {
    if (needs[pair] == 0u) continue;
    if (pair == 0u) wide_nodes[0] = 0u;
    find_members(pair);
    uint next = starts[pair].x + 1u;
#if BALLOT_SLOTS
    uint slots = slots_of_members();
    needs[pair] = slots;
    for (; slots != 0u; slots >>= 4) {
      uint ref = (slots & 15u) == 0u ? END_OF_TREE : member_refs[(slots & 15u) - 1u];
      if (ref < LEAF_BIT) wide_nodes[next++] = pair_at(ref);
    }
#else
    for (uint i = 0u; i < member_count; ++i)
      if (member_refs[i] < LEAF_BIT) wide_nodes[next++] = pair_at(member_refs[i]);
#endif
  }
}
