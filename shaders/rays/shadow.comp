#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Ray generator "shadow": shadow rays towards the point light, which end shortly before it.
#include "../lib/origin/secondary.glsl"

Ray ray_from(Surface s, Draw draw) {
  precise vec3 to_light = push.light - origin_on(s, 1.0);
  vec3 dir = exact_unit(to_light);
  precise float t_max = 0.999 * exact_dot(to_light, dir);
  return leave(s, 1.0, dir, t_max);
}
