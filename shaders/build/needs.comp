#version 460
#extension GL_GOOGLE_include_directive : require
// Sums up what the nodes of a block need, one block a workgroup (lib/build/places.glsl).
#include "../lib/build/places.glsl"

layout(set = 0, binding = BIND_BUILD_NEEDS, std430) readonly buffer Needs { uint needs[]; };

BUILD_MAIN {
  uint end = min((gl_WorkGroupID.x + 1u) * BUILD_BLOCK, nodes_to_place()), sum = 0u, total;
  for (uint i = gl_WorkGroupID.x * BUILD_BLOCK + lane_of_group(); i < end; i += GROUP_SIZE)
    sum += packed(need_of(needs[i]));
  sum_before(sum, total);
  if (lane_of_group() == 0u) sums[gl_WorkGroupID.x] = unpacked(total);
}
