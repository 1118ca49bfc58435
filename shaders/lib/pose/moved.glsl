// Triangles that move with their part, and their vertices.
#include "../../shared/pose.h"

layout(local_size_x = POSE_GROUP) in;
layout(push_constant, scalar) uniform Push { MovePush push; };
struct Vertex { vec3 position, normal; };
layout(set = 0, binding = BIND_POSE_MOVED, scalar) readonly buffer Moved { MovedPart moved[]; };
layout(set = 0, binding = BIND_POSE_CORNERS, scalar) readonly buffer Corners { uint corners[]; };
layout(set = 0, binding = BIND_POSE_POSED, scalar) readonly buffer Posed { Vertex posed[]; };
layout(set = 0, binding = BIND_POSE_PLACED, scalar) readonly buffer Placed { Vertex placed[]; };

// Returns the part of a triangle, counted among those that move: the last one that does not begin behind it.
uint part_of_triangle(uint triangle) {
  uint first = 0u, end = push.parts;
  while (end - first > 1u) {
    uint middle = (first + end) / 2u;
    if (moved[middle].first_moved <= triangle)
      first = middle;
    else
      end = middle;
  }
  return first;
}

Vertex corner_of(MovedPart part, uint triangle, uint corner) {
  if (part.turned != 0u) corner = (3u - corner) % 3u;
  uint v = part.first_posed + corners[part.first_corner + 3u * (triangle - part.first_moved) + corner];
  if (part.whole != 0u) return Vertex(placed[v].position, placed[v].normal);
  return Vertex(posed[v].position, posed[v].normal);
}
