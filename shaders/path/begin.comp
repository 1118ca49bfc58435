#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
// Camera rays of listed pixels, several samples of each, and the paths that begin with them.
#include "../shared/render.h"
#include "../lib/records.glsl"
#include "../lib/put_records.glsl"
#include "../lib/film.glsl"
#include "../lib/random.glsl"
#include "../lib/camera.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { BeginPush push; };
RECORDS_OUT(BIND_RAYS, Rays, rays)
RECORDS_OUT(BIND_CARRIED, CarriedRays, carried)
RECORDS_OUT(BIND_PATHS, Paths, paths)
layout(set = 0, binding = BIND_LISTED, scalar) readonly buffer Listed { uint listed[]; };

void main() {
  uint path = put_index(), first = path - gl_SubgroupInvocationID;
  bool wanted = path < push.camera.count;
  uint place = push.camera.first + path / push.camera.together;
  uint sample_index = push.camera.sample_index + path % push.camera.together;
  uvec2 pixel = listed_pixel(wanted ? listed[place] : 0u);
  uint number = pixel.y * push.camera.width + pixel.x;
  if (push.seed != 0u) number += hash_word(push.seed);
  Ray ray = camera_ray(push.camera, pixel, number, sample_index);
  Carried all = Carried(vec3(1.0), path, 0.0, push.cone_width, push.cone_spread, 0u);
  Path begun = Path(vec3(0.0), number, sample_index, place, 0u, 0u);
  PUT_RECORDS(rays, first, wanted, ray)
  PUT_RECORDS(carried, first, wanted, all)
  PUT_RECORDS(paths, first, wanted, begun)
}
