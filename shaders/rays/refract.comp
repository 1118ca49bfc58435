#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Ray generator "refract": refraction by Snell's law from air into glass of index 1.5, whatever the material and
// whichever side was hit.
#include "../lib/origin/secondary.glsl"

const float ETA = 1.0 / 1.5;

Ray ray_from(Surface s, Draw draw) {
  precise float cos_in = -exact_dot(s.dir, s.normal);
  precise float cos_out = exact_sqrt(1.0 - ETA * ETA * (1.0 - cos_in * cos_in));
  precise vec3 dir = s.dir * ETA + s.normal * (ETA * cos_in - cos_out);
  return leave(s, -1.0, exact_unit(dir), 1e30);
}
