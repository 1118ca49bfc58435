#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Ray generator "reflect": mirror reflection, whatever the material.
#include "../lib/origin/secondary.glsl"

Ray ray_from(Surface s, Draw draw) {
  precise vec3 dir = s.dir - s.normal * (2.0 * exact_dot(s.dir, s.normal));
  return leave(s, 1.0, exact_unit(dir), 1e30);
}
