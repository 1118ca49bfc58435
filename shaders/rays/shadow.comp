#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Towards the point light; ends shortly before it.
#include "../lib/secondary.glsl"

Ray ray_from(Surface s, uint k) {
  vec3 origin = origin_above(s);
  precise vec3 to_light = push.light - origin;
  vec3 dir = exact_unit(to_light);
  precise float t_max = 0.999 * exact_dot(to_light, dir);
  return Ray(origin, 0.0, dir, t_max);
}
