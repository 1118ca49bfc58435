#version 460
#extension GL_GOOGLE_include_directive : require
// Prepares a tree of pairs to be collapsed (lib/build/collapse.glsl): writes where each pair hangs, and counts its
// leaves as children that have arrived (collapse_plan.comp).
#include "../lib/build/frame.glsl"

layout(push_constant, scalar) uniform Push { CollapsePush push; };
layout(set = 0, binding = BIND_BUILD_PARENTS, std430) writeonly buffer Parents { uint parents[]; };
layout(set = 0, binding = BIND_BUILD_ARRIVALS, std430) writeonly buffer Arrivals { uint arrivals[]; };
layout(set = 0, binding = BIND_BUILD_PAIRS, std430) readonly buffer Pairs { uvec4 pairs[]; };

void main() {
  const uint TEXELS = PAIR_TEXELS(LAYOUT_INTERLEAVED);
  for (uint pair = gl_GlobalInvocationID.x; pair < push.pairs; pair += gl_NumWorkGroups.x * GROUP_SIZE) {
    uvec4 refs = pairs[pair * TEXELS + 3u];
    uint leaves = 0u;
    for (uint side = 0u; side < 2u; ++side) {
      if (refs[side] >= LEAF_BIT)
        ++leaves;
      else
        parents[refs[side] / TEXELS] = pair << 1 | side;
    }
    arrivals[pair] = leaves;
  }
}
