#version 460
#extension GL_GOOGLE_include_directive : require
// Finds the bounds of all triangles with area, and how many there are. An invocation takes triangles in strides of the
// dispatch.
#include "../lib/build/frame.glsl"

layout(push_constant, scalar) uniform Push { BuildPush push; };
layout(set = 0, binding = BIND_BUILD_STATE, scalar) buffer State { BuildState state; };
#include "../lib/build/order.glsl"
#include "../lib/build/triangles.glsl"

shared uint group_lo[3], group_hi[3], group_proper;

void main() {
  if (gl_LocalInvocationIndex < 3u) {
    group_lo[gl_LocalInvocationIndex] = 0xFFFFFFFFu;
    group_hi[gl_LocalInvocationIndex] = 0u;
    group_proper = 0u;
  }
  barrier();
  uvec3 lo = uvec3(0xFFFFFFFFu), hi = uvec3(0u);
  uint proper = 0u;
  for (uint i = gl_GlobalInvocationID.x; i < push.triangles; i += gl_NumWorkGroups.x * GROUP_SIZE) {
    Corners t = corners_of(i);
    if (has_no_area(t)) continue;
    lo = min(lo, ordered(lo_of(t)));
    hi = max(hi, ordered(hi_of(t)));
    ++proper;
  }
  if (proper > 0u) {
    for (uint k = 0u; k < 3u; ++k) {
      atomicMin(group_lo[k], lo[k]);
      atomicMax(group_hi[k], hi[k]);
    }
    atomicAdd(group_proper, proper);
  }
  barrier();
  if (gl_LocalInvocationIndex < 3u && group_proper > 0u) {
    uint k = gl_LocalInvocationIndex;
    atomicMin(state.lo[k], group_lo[k]);
    atomicMax(state.hi[k], group_hi[k]);
    if (k == 0u) atomicAdd(state.proper, group_proper);
  }
}
