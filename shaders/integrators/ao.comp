#version 460
#extension GL_GOOGLE_include_directive : require
// Integrator "ao": ambient occlusion. A hit starts one short ray, distributed by the cosine about the shading normal.
// The path is white if the ray meets nothing, else black.
#define STARTS_SHADOW 1
#define STARTS_NEXT 0
#define STARTS_SECOND 0
#include "../lib/path/kernel.glsl"
#include "../lib/path/first_hit.glsl"

void shade_hit(inout Path path, PixelSample sampled, Ray ray, Hit hit, Carried c, inout Started started) {
  Surface s = surface_of(ray, hit);
  vec3 n = smooth_normal(hit, s.normal);
  vec3 to = cosine_about(n, draw2(sampled, 0u));
  started.shadow = dot(to, s.normal) > 0.0;
  started.shadow_ray = leave(s, 1.0, to, push.ao_radius);
  started.light = vec3(1.0);
  RECORD_FIRST_HIT(path, sampled, ray, hit, n)
}

#include "../lib/path/main.glsl"
