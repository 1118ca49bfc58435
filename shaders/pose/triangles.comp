#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Writes the triangles that move, one invocation each, and finds their bounds.
#include "../lib/pose/moved.glsl"
#include "../lib/pose/bounds.glsl"

layout(set = 0, binding = BIND_POSE_TRIANGLES, scalar) writeonly buffer Triangles { vec3 triangles[]; };

void main() {
  begin_bounds();
  for (uint i = gl_GlobalInvocationID.x; i < push.items; i += gl_NumWorkGroups.x * POSE_GROUP) {
    MovedPart part = moved[part_of_triangle(i)];
    uint to = 3u * (part.first_triangle + (i - part.first_moved));
    for (uint k = 0u; k < 3u; ++k) {
      vec3 v = corner_of(part, i, k).position;
      triangles[to + k] = v;
      check_range(v, 0u);
      add_to_bounds(v);
    }
  }
  end_bounds();
}
