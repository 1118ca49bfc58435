#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
// Camera rays, one an invocation, in tiles of Morton order.
#include "../shared/render.h"
#include "../lib/records.glsl"
#include "../lib/put_records.glsl"
#include "../lib/film.glsl"
#include "../lib/random.glsl"
#include "../lib/camera.glsl"

#ifndef BALLOT_LISTED
#error a variant must give BALLOT_LISTED: 0, every pixel of whole tiles; 1, those whose numbers a list holds
#endif

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { PrimaryPush push; };
RECORDS_OUT(BIND_RAYS, Rays, rays)
#if BALLOT_LISTED
layout(set = 0, binding = BIND_NUMBERS, scalar) readonly buffer Numbers { uint numbers[]; };
#endif

void main() {
  uint index = put_index(), first = index - gl_SubgroupInvocationID;
  uint number = push.first + index / push.together, sample_index = push.sample_index + index % push.together;
  bool wanted = index < push.count;
#if BALLOT_LISTED
  number = wanted ? numbers[number] : 0u;
#endif
  uvec2 pixel = pixel_of(number, push.width);
  Ray made = camera_ray(push, pixel, pixel.y * push.width + pixel.x, sample_index);
  PUT_RECORDS(rays, first, wanted, made)
}
