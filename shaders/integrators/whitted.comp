#version 460
#extension GL_GOOGLE_include_directive : require
// Integrator "whitted": direct light, and all reflections and refractions of smooth surfaces. A hit starts a shadow ray
// to one point of the lights. A smooth surface starts both the mirrored and the refracted ray, each with its full
// weight.
//
// Source: Turner Whitted. An Improved Illumination Model for Shaded Display. Communications of the ACM 23(6), 1980.
#define BSDF_FINDS_LIGHT 0
#define STARTS_SHADOW HAS_LIGHT
#define STARTS_NEXT BALLOT_HAS_GLOSS
#define STARTS_SECOND (BALLOT_HAS_GLOSS && BALLOT_HAS_GLASS)
#define START_NEXT(sampled, s, b, c, width, started) start_both(s, b, c, width, started)
#include "../lib/path/kernel.glsl"
#include "../lib/path/direct_light.glsl"

#if BALLOT_HAS_GLOSS
// Starts both the mirrored and the refracted ray of a smooth surface, each with its full weight.
void start_both(Surface s, Bsdf b, Carried c, float width, inout Started started) {
  if (b.lambert || !b.mirror) return;
  vec3 f = fresnel_of(b, dot(b.n, b.to_eye)), to = normalize(reflect(-b.to_eye, b.n));
  started.next_carried.throughput = c.throughput * f;
  started.next = dot(to, s.normal) > 0.0 && luminance(started.next_carried.throughput) > 1e-4;
  started.next_ray = leave(s, 1.0, to, 1e30);
  started.next_carried.pdf = 0.0;
  started.next_carried.width = width;
  started.next_carried.spread = c.spread;
#if BALLOT_HAS_GLASS
  vec3 through = refracted(b, b.n);
  started.second_carried = started.next_carried;
  started.second_carried.throughput = c.throughput * (1.0 - f) * b.base * ((1.0 - b.metallic) * b.transmission);
  started.second = dot(through, s.normal) < 0.0 && luminance(started.second_carried.throughput) > 1e-4;
  if (started.second) started.second_ray = leave(s, -1.0, normalize(through), 1e30);
#endif
}
#endif

#include "../lib/path/material_hit.glsl"
#include "../lib/path/main.glsl"
