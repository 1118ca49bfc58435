#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
// Shades hits, one ray a pixel, into the film of a window. Camera rays that the traversal computed are computed again
// here.
#include "../shared/window.h"
#include "../lib/frame/records.glsl"
#include "../lib/shade/film.glsl"

#ifndef BALLOT_RAYS_READ
#error a variant must give BALLOT_RAYS_READ: 0, where the traversal made the rays; 1, where they lie in a buffer
#endif

#if BALLOT_RAYS_READ
RECORDS_IN(BIND_RAYS, Rays, rays)
#else
#include "../lib/shade/random.glsl"
#include "../lib/camera/camera.glsl"
#endif
#include "../lib/shade/shade_hit.glsl"
#include "../lib/shade/live_film.glsl"

RECORDS_IN(BIND_HITS, Hits, hits)

void main() {
  uint index = gl_GlobalInvocationID.x;
  uvec2 pixel = pixel_of(push.camera.first + index, push.camera.width);
  bool live = false;
  if (is_inside(index, pixel)) {
#if BALLOT_RAYS_READ
    Ray ray = get_ray(rays, index);
#else
    Ray ray = camera_ray(push.camera, pixel, pixel.y * push.camera.width + pixel.x, push.camera.sample_index);
#endif
    live = ray.t_max > 0.0;
    FilmPixel p = shade_hit(ray, get_hit(hits, index), push.cone_width, push.cone_spread);
    put_live(index, pixel, p.color);
  }
  count_live(live);
}
