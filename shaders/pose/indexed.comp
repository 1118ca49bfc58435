#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Writes the triangles of a mesh whose vertices have moved, one invocation each, and finds their bounds and the largest
// extents of one. Checks all vertices, those of no triangle too, and indices. What is out of range becomes zero: a
// refit that is recorded before the host knows of it, and will be undone, meets finite numbers alone.
// BALLOT_INDICES: three vertices for each triangle; else vertices 0 1 2, 3 4 5, ...
#include "../shared/pose.h"

layout(local_size_x = POSE_GROUP) in;
layout(push_constant, scalar) uniform Push { IndexedPush push; };
#include "../lib/pose/bounds.glsl"
#if BALLOT_INDICES
layout(set = 0, binding = BIND_POSE_CORNERS, scalar) readonly buffer Corners { uint corners[]; };
#endif
layout(set = 0, binding = BIND_POSE_POSITIONS, scalar) readonly buffer Positions { float positions[]; };
layout(set = 0, binding = BIND_POSE_TRIANGLES, scalar) writeonly buffer Triangles { vec3 triangles[]; };

shared uint group_largest[3];

vec3 position(uint vertex) {
  uint word = push.first_word + push.stride_words * vertex;
  return vec3(positions[word], positions[word + 1u], positions[word + 2u]);
}

void main() {
  if (gl_LocalInvocationIndex < 3u) group_largest[gl_LocalInvocationIndex] = 0u;
  begin_bounds();
  vec3 largest = vec3(0.0);
  uint bad_corner = POSE_NONE;
  for (uint i = gl_GlobalInvocationID.x; i < push.vertices; i += gl_NumWorkGroups.x * POSE_GROUP)
    check_range(position(i), i);
  for (uint i = gl_GlobalInvocationID.x; i < push.items; i += gl_NumWorkGroups.x * POSE_GROUP)
  {
    vec3 lo, hi;
    for (uint k = 0u; k < 3u; ++k) {
      uint corner = 3u * i + k;
      vec3 v = vec3(0.0);
#if BALLOT_INDICES
      uint vertex = corners[corner];
      if (vertex < push.vertices)
        v = position(vertex);
      else
        bad_corner = min(bad_corner, corner);
#else
      v = position(corner);
#endif
      if (!in_range(v)) v = vec3(0.0);
      triangles[3u * push.first_triangle + corner] = v;
      add_to_bounds(v);
      lo = k == 0u ? v : min(lo, v);
      hi = k == 0u ? v : max(hi, v);
    }
    largest = max(largest, hi - lo);
  }
  if (bad_corner != POSE_NONE) atomicMin(state.first_bad_corner, bad_corner);
  for (uint k = 0u; k < 3u; ++k) atomicMax(group_largest[k], floatBitsToUint(largest[k]));
  end_bounds();
  if (gl_LocalInvocationIndex < 3u)
    atomicMax(state.largest[gl_LocalInvocationIndex], group_largest[gl_LocalInvocationIndex]);
}
