#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Surfaces: what materials, textures, colours and normals of vertices say of hits, or of nearest points.
//
// Kernel configuration:
// BALLOT_COLUMNS  a bit for each column that is written: COLUMN_MATERIALS, COLUMN_COLORS, COLUMN_SHADING_NORMALS. The
//                 last holds the normals of the triangles before
// BALLOT_POINTS   1: the records are Nearest, else Hit
// BALLOT_HAS_...  of lib/shade/surface_material.glsl
// One invocation a record. Textures are read at their finest level.
#include "../shared/query.h"
#include "../shared/render.h"

#define WANTS(column) ((BALLOT_COLUMNS >> column & 1) == 1)

layout(local_size_x = COLUMNS_GROUP) in;
layout(push_constant, scalar) uniform Push { SurfacesPush push; };

#include "../lib/query/answers.glsl"
#include "../lib/shade/triangles.glsl"
#include "../lib/shade/surface_material.glsl"

#if WANTS(COLUMN_MATERIALS)
OUT(COLUMN_MATERIALS) writeonly buffer MaterialColumn { uint material_column[]; };
#endif
#if WANTS(COLUMN_COLORS)
OUT(COLUMN_COLORS) writeonly buffer ColorColumn { vec4 color_column[]; };

// Returns the base colour of a material where a hit is, and the share of rays that it stops there.
vec4 color_of(uint material, Hit hit) {
  vec3 color = materials[material].base_color;
#if BALLOT_HAS_BASE_TEXTURE
  color *= base_texture(material, hit, 0.0).rgb;
#endif
#if BALLOT_HAS_COLORS
  color *= vertex_color(hit).rgb;
#endif
  return vec4(color, opacity(material, hit));
}
#endif
#if WANTS(COLUMN_SHADING_NORMALS)
OUT(COLUMN_SHADING_NORMALS) buffer NormalColumn { vec3 normal_column[]; };

// Returns the shading normal on the side of the triangle's own.
vec3 shading_normal(uint material, Hit hit, vec3 n) {
  vec3 smoothed = smooth_normal(hit, n);
#if BALLOT_HAS_NORMAL_TEXTURE
  vec3 a = vertex(hit.prim, 0u), b = vertex(hit.prim, 1u), c = vertex(hit.prim, 2u);
  smoothed = bumped(material, hit, a, b, c, smoothed, true, 0.0);
#endif
  return smoothed;
}
#endif

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= push.records) return;
  uint to = push.to + i;
  Record record = record_of(push.from + i);
  bool is_hit = record.prim != NO_HIT;
  Hit hit = Hit(0.0, record.prim, uintBitsToFloat(record.uv.x), uintBitsToFloat(record.uv.y));
  uint material = NO_HIT;
  if (is_hit) {
    AT_TRIANGLE(record.prim)
    WEIGHTS_OF_VERTICES(hit)
    material = material_of(record.prim);
  }
#if WANTS(COLUMN_MATERIALS)
  material_column[to] = material;
#endif
#if WANTS(COLUMN_COLORS)
  color_column[to] = is_hit ? color_of(material, hit) : vec4(0.0);
#endif
#if WANTS(COLUMN_SHADING_NORMALS)
  if (is_hit) normal_column[to] = shading_normal(material, hit, normal_column[to]);
#endif
}
