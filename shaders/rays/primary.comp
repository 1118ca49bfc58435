#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
// Generates camera rays, one an invocation, in tiles of Morton order.
#include "../shared/render.h"
#include "../lib/frame/records.glsl"
#include "../lib/frame/compact_records.glsl"

#ifndef BALLOT_LISTED
#error a variant must give BALLOT_LISTED: 0, every pixel of whole tiles; 1, those that a list holds
#endif

layout(local_size_x = PASS_GROUP) in;
layout(push_constant, scalar) uniform Push { PrimaryPush push; };
RECORDS_OUT(BIND_RAYS, Rays, rays)
#if BALLOT_LISTED
layout(set = 0, binding = BIND_LISTED, scalar) readonly buffer Listed { uint listed[]; };
#include "../lib/camera/camera_samples.glsl"
#else
#include "../lib/shade/film.glsl"
#include "../lib/shade/random.glsl"
#include "../lib/camera/camera.glsl"
#endif

void main() {
  uint index = put_index(), first = index - gl_SubgroupInvocationID;
  bool wanted = index < push.count;
#if BALLOT_LISTED
  Ray made = camera_ray_of(push, pixel_sample(samples_of(push), wanted ? index : 0u));
#else
  uvec2 pixel = pixel_of(push.first + index, push.width);
  Ray made = camera_ray(push, pixel, pixel.y * push.width + pixel.x, push.sample_index);
#endif
  PUT_RECORDS(rays, first, wanted, made)
}
