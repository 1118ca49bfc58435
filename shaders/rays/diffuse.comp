#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Ray generator "diffuse": one diffuse bounce. Directions are cosine-distributed; the length is unbounded. Neighbouring
// rays diverge at once.
#include "../lib/origin/secondary.glsl"

Ray ray_from(Surface s, Draw draw) {
  vec3 dir = cosine_direction(s, random_number(draw.pixel, draw.k, 4u), random_number(draw.pixel, draw.k, 5u));
  return leave(s, 1.0, dir, 1e30);
}
