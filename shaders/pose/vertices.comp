#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Poses the vertices of skinned and morphed meshes, one invocation each: morph targets are added, the matrices of the
// joints are blended by their weights, and position and normal go through the blended matrix.
//
// engine/model/pose.h defines the result. Every product and sum is rounded by itself, in its order: `precise` keeps
// compilers from contracting them. There is no division and no root, which devices round differently. So the bits are
// those of the host, unless a result is denormal.
#include "../shared/pose.h"

layout(local_size_x = POSE_GROUP) in;
layout(push_constant, scalar) uniform Push { PosePush push; };
struct Influence { uint joint; float weight; };
struct Vertex { vec3 position, normal; };
layout(set = 0, binding = BIND_POSE_PARTS, scalar) readonly buffer Parts { PosePart parts[]; };
layout(set = 0, binding = BIND_POSE_PART_OF, scalar) readonly buffer PartOf { uint part_of[]; };
layout(set = 0, binding = BIND_POSE_POSITIONS, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = BIND_POSE_NORMALS, scalar) readonly buffer Normals { vec3 normals[]; };
layout(set = 0, binding = BIND_POSE_INFLUENCES, scalar) readonly buffer Influences { Influence influences[]; };
layout(set = 0, binding = BIND_POSE_DELTAS, scalar) readonly buffer Deltas { Vertex deltas[]; };
layout(set = 0, binding = BIND_POSE_MATRICES, scalar) readonly buffer Matrices { vec4 rows[]; };
layout(set = 0, binding = BIND_POSE_WEIGHTS, scalar) readonly buffer Weights { float weights[]; };
layout(set = 0, binding = BIND_POSE_POSED, scalar) writeonly buffer Posed { Vertex posed[]; };

struct Blended { vec4 x, y, z; };  // the rows of a matrix

Blended matrix_of(PosePart part, uint vertex) {
  if (part.influences == 0u) {
    uint at = 3u * part.first_matrix;
    return Blended(rows[at], rows[at + 1u], rows[at + 2u]);
  }
  precise vec4 x, y, z;
  uint first = part.first_influence + vertex * part.influences;
  for (uint i = 0u; i < part.influences; ++i) {
    Influence one = influences[first + i];
    uint at = 3u * (part.first_matrix + one.joint);
    precise vec4 a = one.weight * rows[at], b = one.weight * rows[at + 1u], c = one.weight * rows[at + 2u];
    x = i == 0u ? a : x + a;
    y = i == 0u ? b : y + b;
    z = i == 0u ? c : z + c;
  }
  return Blended(x, y, z);
}

float row_times(vec4 row, vec3 p) {
  precise float sum = ((row.x * p.x + row.y * p.y) + row.z * p.z) + row.w;
  return sum;
}

float rounded_dot(vec3 a, vec3 b) {
  precise float sum = (a.x * b.x + a.y * b.y) + a.z * b.z;
  return sum;
}

vec3 rounded_cross(vec3 a, vec3 b) {
  precise vec3 c = vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
  return c;
}

// Moves a normal by the cofactors of a matrix, with the sign of its determinant.
vec3 moved_normal(Blended m, vec3 n) {
  vec3 cx = rounded_cross(m.y.xyz, m.z.xyz), cy = rounded_cross(m.z.xyz, m.x.xyz), cz = rounded_cross(m.x.xyz, m.y.xyz);
  vec3 moved = vec3(rounded_dot(cx, n), rounded_dot(cy, n), rounded_dot(cz, n));
  return rounded_dot(m.x.xyz, cx) < 0.0 ? -moved : moved;
}

void main() {
  for (uint v = gl_GlobalInvocationID.x; v < push.vertices; v += gl_NumWorkGroups.x * POSE_GROUP) {
    PosePart part = parts[part_of[v]];
    uint vertex = v - part.first_posed;
    precise vec3 p = positions[part.first_vertex + vertex], n = normals[part.first_vertex + vertex];
    for (uint k = 0u; k < part.targets; ++k) {
      float weight = weights[part.first_weight + k];
      Vertex d = deltas[part.first_delta + k * part.vertices + vertex];
      p = p + weight * d.position;
      n = n + weight * d.normal;
    }
    Blended m = matrix_of(part, vertex);
    posed[v] = Vertex(vec3(row_times(m.x, p), row_times(m.y, p), row_times(m.z, p)), moved_normal(m, n));
  }
}
