#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// One diffuse bounce: cosine-distributed, without end. Neighbouring rays part at once.
#include "../lib/origin/secondary.glsl"

Ray ray_from(Surface s, Draw draw) {
  vec3 dir = cosine_direction(s, random_number(draw.pixel, draw.k, 4u), random_number(draw.pixel, draw.k, 5u));
  return leave(s, 1.0, dir, 1e30);
}
