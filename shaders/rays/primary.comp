#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Camera rays, one an invocation, in tiles of Morton order.
#include "../shared/render.h"
#include "../lib/records.glsl"
#include "../lib/film.glsl"
#include "../lib/random.glsl"
#include "../lib/camera.glsl"

#ifndef BALLOT_LISTED
#error a variant must give BALLOT_LISTED: 0, every ray of whole tiles; 1, the rays whose numbers a list holds
#endif

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { PrimaryPush push; };
RECORDS(writeonly, BIND_RAYS, Rays, rays);
#if BALLOT_LISTED
layout(set = 0, binding = BIND_NUMBERS, scalar) readonly buffer Numbers { uint numbers[]; };
#endif

void main() {
  if (gl_GlobalInvocationID.x >= uint(rays.length()) / 2u) return;
#if BALLOT_LISTED
  uint ray = numbers[gl_GlobalInvocationID.x];
#else
  uint ray = push.first + gl_GlobalInvocationID.x;
#endif
  uvec2 pixel = pixel_of(ray, push.width);
  Ray made = camera_ray(push, pixel, pixel.y * push.width + pixel.x, push.sample_index);
  put_record(rays, gl_GlobalInvocationID.x, made);
}
