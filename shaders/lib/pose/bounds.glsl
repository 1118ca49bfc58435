// Bounds of the triangles that a kernel writes, and the first vertex with a coordinate beyond +-1e12 or that is no
// number. Every invocation begins and ends with the calls below, and adds and checks vertices in between.
layout(set = 0, binding = BIND_POSE_STATE, scalar) buffer State { PoseState state; };
#include "../build/order.glsl"

shared uint group_lo[3], group_hi[3], group_first_bad;
uvec3 own_lo, own_hi;
uint own_first_bad;

void begin_bounds() {
  if (gl_LocalInvocationIndex < 3u) {
    group_lo[gl_LocalInvocationIndex] = 0xFFFFFFFFu;
    group_hi[gl_LocalInvocationIndex] = 0u;
    group_first_bad = POSE_NONE;
  }
  barrier();
  own_lo = uvec3(0xFFFFFFFFu);
  own_hi = uvec3(0u);
  own_first_bad = POSE_NONE;
}

bool in_range(vec3 v) {
  return all(lessThanEqual(floatBitsToUint(v) & 0x7FFFFFFFu, uvec3(floatBitsToUint(1e12))));
}

void check_range(vec3 v, uint vertex) {
  if (!in_range(v)) own_first_bad = min(own_first_bad, vertex);
}

void add_to_bounds(vec3 v) {
  own_lo = min(own_lo, ordered(v));
  own_hi = max(own_hi, ordered(v));
}

void end_bounds() {
  for (uint k = 0u; k < 3u; ++k) {
    atomicMin(group_lo[k], own_lo[k]);
    atomicMax(group_hi[k], own_hi[k]);
  }
  atomicMin(group_first_bad, own_first_bad);
  barrier();
  if (gl_LocalInvocationIndex < 3u) {
    uint k = gl_LocalInvocationIndex;
    atomicMin(state.lo[k], group_lo[k]);
    atomicMax(state.hi[k], group_hi[k]);
    if (k == 0u && group_first_bad != POSE_NONE) atomicMin(state.first_bad, group_first_bad);
  }
}
