#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Shades the hits of a batch into the film, one ray a pixel. engine/render/batch/batch.h reports its time as the cost
// of shading a frame.
#include "../shared/render.h"
#include "../lib/frame/records.glsl"
#include "../lib/shade/shade_hit.glsl"

layout(local_size_x = PASS_GROUP) in;
layout(push_constant, scalar) uniform Push { ShadePush push; };
RECORDS_IN(BIND_RAYS, Rays, rays)
RECORDS_IN(BIND_HITS, Hits, hits)
layout(set = 0, binding = BIND_FILM, scalar) writeonly buffer Film { FilmPixel film[]; };

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index < push.count) film[index] = shade_hit(get_ray(rays, index), get_hit(hits, index), 0.0, 0.0);
}
