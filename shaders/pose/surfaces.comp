#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Moves what shading reads of the triangles that move, one invocation each: their vertices and, with
// BALLOT_POSE_NORMALS, their normals. The words that lie with the vertices stay. A corner without a normal gets that of
// the triangle.
#include "../lib/pose/moved.glsl"

layout(set = 0, binding = BIND_POSE_TRIANGLE_TEXELS, std430) buffer TriangleTexels { uvec4 triangle_texels[]; };
#if BALLOT_POSE_NORMALS
layout(set = 0, binding = BIND_POSE_NORMAL_TEXELS, std430) writeonly buffer NormalTexels { uvec4 normal_texels[]; };
#include "../lib/pose/unit.glsl"

// Returns the unit normal of a triangle by the right-hand rule; (0, 1, 0) if it has no area.
vec3 geometric_normal(vec3 a, vec3 b, vec3 c) {
  vec3 n = unit_or_zero(cross(dvec3(b) - dvec3(a), dvec3(c) - dvec3(a)));
  return n == vec3(0.0) ? vec3(0.0, 1.0, 0.0) : n;
}
#endif

void main() {
  for (uint i = gl_GlobalInvocationID.x; i < push.items; i += gl_NumWorkGroups.x * POSE_GROUP) {
    MovedPart part = moved[part_of_triangle(i)];
    uint to = 3u * (part.first_triangle + (i - part.first_moved));
    Vertex v[3];
    for (uint k = 0u; k < 3u; ++k) {
      v[k] = corner_of(part, i, k);
      triangle_texels[to + k].xyz = floatBitsToUint(v[k].position);
    }
#if BALLOT_POSE_NORMALS
    for (uint k = 0u; k < 3u; ++k) {
      vec3 n = part.whole != 0u ? v[k].normal : unit_or_zero(dvec3(v[k].normal));
      if (n == vec3(0.0)) n = geometric_normal(v[0].position, v[1].position, v[2].position);
      normal_texels[to + k] = uvec4(floatBitsToUint(n), 0u);
    }
#endif
  }
}
