#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Writes the triangles that move, one invocation each, and finds their bounds. Coordinates beyond +-1e12, or that are
// no numbers, are reported.
#include "../lib/pose/moved.glsl"

layout(set = 0, binding = BIND_POSE_TRIANGLES, scalar) writeonly buffer Triangles { vec3 triangles[]; };
layout(set = 0, binding = BIND_POSE_STATE, scalar) buffer State { PoseState state; };
#include "../lib/build/order.glsl"

shared uint group_lo[3], group_hi[3], group_bad;

bool in_range(vec3 v) {
  return all(lessThanEqual(floatBitsToUint(v) & 0x7FFFFFFFu, uvec3(floatBitsToUint(1e12))));
}

void main() {
  if (gl_LocalInvocationIndex < 3u) {
    group_lo[gl_LocalInvocationIndex] = 0xFFFFFFFFu;
    group_hi[gl_LocalInvocationIndex] = 0u;
    group_bad = 0u;
  }
  barrier();
  uvec3 lo = uvec3(0xFFFFFFFFu), hi = uvec3(0u);
  bool good = true;
  for (uint i = gl_GlobalInvocationID.x; i < push.items; i += gl_NumWorkGroups.x * POSE_GROUP) {
    MovedPart part = moved[part_of_triangle(i)];
    uint to = 3u * (part.first_triangle + (i - part.first_moved));
    for (uint k = 0u; k < 3u; ++k) {
      vec3 v = corner_of(part, i, k).position;
      triangles[to + k] = v;
      good = good && in_range(v);
      lo = min(lo, ordered(v));
      hi = max(hi, ordered(v));
    }
  }
  for (uint k = 0u; k < 3u; ++k) {
    atomicMin(group_lo[k], lo[k]);
    atomicMax(group_hi[k], hi[k]);
  }
  if (!good) atomicOr(group_bad, 1u);
  barrier();
  if (gl_LocalInvocationIndex < 3u) {
    uint k = gl_LocalInvocationIndex;
    atomicMin(state.lo[k], group_lo[k]);
    atomicMax(state.hi[k], group_hi[k]);
    if (k == 0u && group_bad != 0u) atomicOr(state.bad, 1u);
  }
}
