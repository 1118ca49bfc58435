#version 460
#extension GL_GOOGLE_include_directive : require
// Finds the pairs that are wide nodes (lib/build/collapse.glsl), and what each needs: see lib/build/places.glsl.
//
// The number of children that a pair is divided into follows from that of the pair above, and so on up to the root. But
// it is mostly the same for any number a few pairs above. A lane goes up from its pair until that holds: 3 to 6 steps
// in the mean of trees of 300 000 triangles. So no pair waits for the one above, and no level needs a dispatch.
#include "../lib/build/frame.glsl"

layout(push_constant, scalar) uniform Push { CollapsePush push; };
layout(set = 0, binding = BIND_BUILD_PARENTS, std430) readonly buffer Parents { uint parents[]; };
layout(set = 0, binding = BIND_BUILD_NEEDS, std430) writeonly buffer Needs { uint needs[]; };
#define BALLOT_LAYOUT LAYOUT_INTERLEAVED
#include "../lib/build/read_pair.glsl"
#include "../lib/build/collapse.glsl"
#include "../lib/build/members.glsl"

// A map of numbers of children, from 2 to WIDTH, four bits each. Where a pair is divided into WIDTH it is a wide node.
uint mapped(uint map, uint n) { return map >> 4u * (n - 1u) & 15u; }
uint mapping(uint n, uint to) { return to << 4u * (n - 1u); }
bool is_constant(uint map) {
  uint all = 0u;
  for (uint n = 2u; n <= WIDTH; ++n) all |= mapping(n, mapped(map, WIDTH));
  return map == all;
}

// Returns the map from the number of children that the pair above is divided into to that of this pair.
uint map_from_above(uint pair, uint above) {
  uint choice = choices[pair], choice_above = choices[above >> 1], map = 0u;
  for (uint n = 2u; n <= WIDTH; ++n) {
    uint left = left_of(choice_above, n), to = becomes(choice, (above & 1u) == 0u ? left : n - left);
    map |= mapping(n, to == 1u ? WIDTH : to);
  }
  return map;
}

bool is_wide_node(uint pair) {
  if (pair == 0u) return true;
  uint above = parents[pair];
  if (above == BUILD_NONE) return false;  // the pair is not used
  uint map = map_from_above(pair, above);
  while (!is_constant(map) && above >> 1 != 0u) {
    uint at = above >> 1, further = 0u;
    above = parents[at];
    uint next = map_from_above(at, above);
    for (uint n = 2u; n <= WIDTH; ++n) further |= mapping(n, mapped(map, mapped(next, n)));
    map = further;
  }
  return mapped(map, WIDTH) == WIDTH;  // the root is divided into WIDTH
}

void main() {
  for (uint pair = gl_GlobalInvocationID.x; pair < push.pairs; pair += gl_NumWorkGroups.x * GROUP_SIZE) {
    uint need = 0u;
    if (is_wide_node(pair)) {
      find_members(pair);
      uint leaves = 0u;
      for (uint i = 0u; i < member_count; ++i) leaves += uint(member_refs[i] >= LEAF_BIT);
      need = COLLAPSE_NODE | (member_count - leaves) | (leaves + 3u) / 4u << 8;
    }
    needs[pair] = need;
  }
}
