#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Hits of rays, one a pixel, to film.
#include "../shared/render.h"
#include "../lib/records.glsl"
#include "../lib/film.glsl"
#include "../lib/shade_hit.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { ShadePush push; };
RECORDS_IN(BIND_RAYS, Rays, rays)
RECORDS_IN(BIND_HITS, Hits, hits)
layout(set = 0, binding = BIND_FILM, scalar) buffer Film { FilmPixel film[]; };

void main() {
  uint index = gl_GlobalInvocationID.x;
  uvec2 pixel = pixel_of(push.first + index, push.width);
  if (index >= push.count || pixel.x >= push.width || pixel.y >= push.height) return;
  FilmPixel p = shade_hit(get_ray(rays, index), get_hit(hits, index), push.cone_width, push.cone_spread);
  if (push.sample_index == 0u) {
    film[index] = p;
  } else {
    film[index].color += p.color;
    film[index].alpha += p.alpha;
  }
}
