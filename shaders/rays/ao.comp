#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Ray generator "ao": ambient occlusion rays. Directions are cosine-distributed; the length is bounded.
#include "../lib/origin/secondary.glsl"

Ray ray_from(Surface s, Draw draw) {
  vec3 dir = cosine_direction(s, random_number(draw.pixel, draw.k, 2u), random_number(draw.pixel, draw.k, 3u));
  return leave(s, 1.0, dir, push.radius);
}
