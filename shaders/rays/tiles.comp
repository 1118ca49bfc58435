#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Lists the pixels of whole tiles in ray order, including those outside the picture.
#include "../shared/render.h"
#include "../lib/shade/film.glsl"

layout(local_size_x = PASS_GROUP) in;
layout(push_constant, scalar) uniform Push { TilesPush push; };
layout(set = 0, binding = BIND_LISTED, scalar) writeonly buffer Listed { uint listed[]; };

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index >= push.count) return;
  uvec2 pixel = pixel_of(index, push.width);
  listed[index] = LISTED_PIXEL(pixel.x, pixel.y);
}
