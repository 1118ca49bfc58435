#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Places the triangles of an overlay. The shader fetches vertices and indices itself, so the pipeline needs no vertex
// input.
#include "../shared/paint.h"

layout(push_constant, scalar) uniform Push { PaintPush push; };
layout(set = 0, binding = BIND_VERTICES, scalar) readonly buffer Vertices { PaintVertex vertices[]; };
layout(set = 0, binding = BIND_INDICES, scalar) readonly buffer Indices { uint indices[]; };
layout(location = 0) out vec4 color;
layout(location = 1) out vec2 at;

void main() {
  PaintVertex v = vertices[push.first_vertex + indices[gl_VertexIndex]];
  color = unpackUnorm4x8(v.color);
  at = vec2(v.u, v.v);
  gl_Position = vec4(v.x * push.scale_x - 1.0, v.y * push.scale_y - 1.0, 0.0, 1.0);
}
