#version 460
#extension GL_GOOGLE_include_directive : require
// Integrator "path": path tracing. A hit starts a shadow ray to one point of the lights, and one ray in a direction
// that the BSDF samples. From ROULETTE_DEPTH on, Russian roulette ends paths of low throughput.
//
// Source: James T. Kajiya. The Rendering Equation. SIGGRAPH 1986.
#define BSDF_FINDS_LIGHT 1
#define STARTS_SHADOW HAS_LIGHT
#define STARTS_NEXT 1
#define STARTS_SECOND 0
#define START_NEXT(sampled, s, b, c, width, started) start_next(sampled, s, b, c, width, started)
#include "../lib/path/kernel.glsl"
#include "../lib/path/direct_light.glsl"

const uint ROULETTE_DEPTH = 3u;

void start_next(PixelSample sampled, Surface s, Bsdf b, Carried c, float width, inout Started started) {
  vec3 weight;
  float density, side;
  vec3 to = sample_bsdf(b, draw(sampled, 3u), draw2(sampled, 4u), weight, density, side);
  vec3 throughput = c.throughput * weight;
  float keep = 1.0;
  if (RAY_DEPTH >= ROULETTE_DEPTH) keep = clamp(max(throughput.r, max(throughput.g, throughput.b)), 0.05, 0.95);
  bool inside = dot(to, s.normal) * side > 0.0;  // of the geometric normal, not only of the shading normal
  started.next = inside && max(throughput.r, max(throughput.g, throughput.b)) > 0.0 && draw(sampled, 6u) < keep;
  started.next_ray = leave(s, side, to, 1e30);
  started.next_carried.throughput = throughput / keep;
  started.next_carried.pdf = density;
  started.next_carried.width = width;
  started.next_carried.spread = density > 0.0 ? max(c.spread, ROUGH_SPREAD) : c.spread;
}

#include "../lib/path/material_hit.glsl"
#include "../lib/path/main.glsl"
