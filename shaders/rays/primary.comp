#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Camera rays, one an invocation, in tiles of Morton order.
//
//   pixel (0, 0) is top left:      corner --- step_x -->          the camera looks along -z of its frame, +y is up,
//                                    |                            right-handed; a ray goes through
//                                  step_y                         corner + x * step_x + y * step_y
//                                    v
#include "../shared/render.h"
#include "../lib/film.glsl"
#include "../lib/random.glsl"

#ifndef BALLOT_LISTED
#error a variant must give BALLOT_LISTED: 0, every ray of whole tiles; 1, the rays whose numbers a list holds
#endif

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { PrimaryPush push; };
layout(set = 0, binding = BIND_RAYS, scalar) writeonly buffer Rays { Ray rays[]; };
#if BALLOT_LISTED
layout(set = 0, binding = BIND_NUMBERS, scalar) readonly buffer Numbers { uint numbers[]; };
#endif

void main() {
  if (gl_GlobalInvocationID.x >= uint(rays.length())) return;
#if BALLOT_LISTED
  uint ray = numbers[gl_GlobalInvocationID.x];
#else
  uint ray = push.first + gl_GlobalInvocationID.x;
#endif
  uvec2 pixel = pixel_of(ray, push.width);
  vec2 offset = vec2(0.5);
  if (push.sample_count > 1u) {
    uint number = pixel.y * push.width + pixel.x;
    offset = vec2(random_number(number, push.sample_index, 0u), random_number(number, push.sample_index, 1u));
  }
  precise vec2 at = vec2(pixel) + offset;
  precise vec3 plane = push.corner + at.x * push.step_x + at.y * push.step_y;
  bool inside = pixel.x < push.width && pixel.y < push.height;
  bool orthographic = push.orthographic != 0u;
  vec3 origin = orthographic ? plane : push.origin;
  vec3 dir = orthographic ? push.origin : plane;
  rays[gl_GlobalInvocationID.x] = Ray(origin, 0.0, dir, inside ? 1e30 : 0.0);
}
