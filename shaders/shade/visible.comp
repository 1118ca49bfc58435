#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
// Writes the results of any-hit rays to the film of a window: white where a ray hit nothing, black where it hit
// something or where there was no ray.
#include "../shared/window.h"
#include "../lib/frame/records.glsl"
#include "../lib/shade/film.glsl"
#include "../lib/shade/live_film.glsl"

RECORDS_IN(BIND_RAYS, Rays, rays)
RECORDS_IN(BIND_HITS, Hits, hits)

void main() {
  uint index = gl_GlobalInvocationID.x;
  uvec2 pixel = pixel_of(push.camera.first + index, push.camera.width);
  bool live = false;
  if (is_inside(index, pixel)) {
    live = get_ray(rays, index).t_max > 0.0;
    put_live(index, pixel, vec3(live && get_hit(hits, index).prim == NO_HIT ? 1.0 : 0.0));
  }
  count_live(live);
}
