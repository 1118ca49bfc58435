#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Answers of any-hit rays to film: white where a ray met nothing, black where it did or there was no ray.
#include "../shared/render.h"
#include "../lib/records.glsl"
#include "../lib/film.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { ShadePush push; };
RECORDS_IN(BIND_RAYS, Rays, rays)
RECORDS_IN(BIND_HITS, Hits, hits)
layout(set = 0, binding = BIND_FILM, scalar) buffer Film { FilmPixel film[]; };

void main() {
  uint index = gl_GlobalInvocationID.x;
  uvec2 pixel = pixel_of(push.first + index, push.width);
  if (index >= push.count || pixel.x >= push.width || pixel.y >= push.height) return;
  bool live = get_ray(rays, index).t_max > 0.0, hit = get_hit(hits, index).prim != NO_HIT;
  vec3 color = vec3(live && !hit ? 1.0 : 0.0);
  if (push.sample_index == 0u) {
    // Which of several triangles an any-hit ray finds is open; whether it finds one is not.
    film[index] = FilmPixel(color, live ? 1.0 : 0.0, 0.0, vec3(0.0), hit ? 0u : NO_HIT);
  } else {
    film[index].color += color;
    film[index].alpha += live ? 1.0 : 0.0;
  }
}
