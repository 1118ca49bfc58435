#version 460
#extension GL_GOOGLE_include_directive : require
// Writes where the room of each node starts: pairs, texels of leaves (lib/build/places.glsl). One block a workgroup.
#include "../lib/build/places.glsl"

layout(set = 0, binding = BIND_BUILD_NEEDS, std430) readonly buffer Needs { uint needs[]; };
layout(set = 0, binding = BIND_BUILD_STARTS, std430) writeonly buffer Starts { uvec2 starts[]; };

BUILD_MAIN {
  uvec2 start = sums[gl_WorkGroupID.x];
  for (uint first = 0u; first < BUILD_BLOCK; first += GROUP_SIZE) {
    uint i = gl_WorkGroupID.x * BUILD_BLOCK + first + lane_of_group(), total;
    bool inside = i < nodes_to_place();
    uint before = sum_before(inside ? packed(need_of(needs[i])) : 0u, total);
    if (inside) starts[i] = start + unpacked(before);
    start += unpacked(total);
  }
}
