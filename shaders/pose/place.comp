#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Places the vertices of parts that move as a whole, one invocation each, in float64 and rounded once: positions with
// the bits of the host (transform_point() of engine/model/placing.h). Normals are made unit vectors, or zero.
#include "../shared/pose.h"

layout(local_size_x = POSE_GROUP) in;
layout(push_constant, scalar) uniform Push { MovePush push; };
struct Vertex { vec3 position, normal; };
layout(set = 0, binding = BIND_POSE_MOVED, scalar) readonly buffer Moved { MovedPart moved[]; };
layout(set = 0, binding = BIND_POSE_PART_OF, scalar) readonly buffer PartOf { uint part_of[]; };
layout(set = 0, binding = BIND_POSE_PLACES, scalar) readonly buffer Places { PartPlace places[]; };
layout(set = 0, binding = BIND_POSE_POSITIONS, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = BIND_POSE_NORMALS, scalar) readonly buffer Normals { vec3 normals[]; };
layout(set = 0, binding = BIND_POSE_PLACED, scalar) writeonly buffer Placed { Vertex placed[]; };
#include "../lib/pose/unit.glsl"

float moved_coordinate(uint part, uint row, dvec3 p) {
  precise double sum = ((places[part].world[4u * row] * p.x + places[part].world[4u * row + 1u] * p.y) +
                        places[part].world[4u * row + 2u] * p.z) + places[part].world[4u * row + 3u];
  return float(sum);
}

double turned_coordinate(uint part, uint row, dvec3 n) {
  return places[part].normal[3u * row] * n.x + places[part].normal[3u * row + 1u] * n.y +
         places[part].normal[3u * row + 2u] * n.z;
}

void main() {
  for (uint v = gl_GlobalInvocationID.x; v < push.items; v += gl_NumWorkGroups.x * POSE_GROUP) {
    uint part = part_of[v], from = moved[part].first_vertex + (v - moved[part].first_posed);
    dvec3 p = dvec3(positions[from]), n = dvec3(normals[from]);
    vec3 to = vec3(moved_coordinate(part, 0u, p), moved_coordinate(part, 1u, p), moved_coordinate(part, 2u, p));
    dvec3 turned =
        dvec3(turned_coordinate(part, 0u, n), turned_coordinate(part, 1u, n), turned_coordinate(part, 2u, n));
    placed[v] = Vertex(to, unit_or_zero(turned));
  }
}
