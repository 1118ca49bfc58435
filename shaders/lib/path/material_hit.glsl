// Shades a hit by its material: emission, a shadow ray, and the integrator's own secondary rays. If STARTS_NEXT, the
// integrator defines before this file
//
//   START_NEXT(sampled, s, b, c, width, started)   starts the rays of the next depth that leave surface s with BSDF b;
//                                                  `width` is the width of the cone there; takes random numbers 3 to 7
//
// It is not called at the last path depth. Needs direct_light.glsl.

void scatter(inout Path path, PixelSample sampled, Surface s, Look look, Carried c, float distance, float width,
             inout Started started) {
#if BALLOT_HAS_UNLIT
  if ((look.m.flags & MATERIAL_UNLIT) != 0u) {
    path.radiance += c.throughput * look.m.base_color;
    return;
  }
#endif
#if BALLOT_HAS_EMISSION
  float aimed = c.pdf > 0.0 ? emission_density(look.m.emitted, distance, dot(s.normal, s.dir)) : 0.0;
#if BALLOT_HAS_SHAPES
  if (s.shape) aimed = 0.0;  // light sampling finds triangles alone
#endif
  path.radiance += c.throughput * look.m.emissive * weigh(c.pdf, aimed);
#endif
  Bsdf b = bsdf_of(look, s.dir, s.normal, s.front);
#if HAS_LIGHT
  start_shadow(sampled, s, b, c, started);
#endif
#if STARTS_NEXT
  if (RAY_DEPTH < push.last_depth) START_NEXT(sampled, s, b, c, width, started);
#endif
}

#include "first_hit.glsl"

void shade_hit(inout Path path, PixelSample sampled, Ray ray, Hit hit, Carried c, inout Started started) {
  Surface s = surface_of(ray, hit);
  WEIGHTS_OF_VERTICES(hit)
  float distance = hit.t * length(ray.dir), width = c.width + c.spread * distance;
  Look look = look_at(hit, material_of(hit.prim), s.v0, s.v1, s.v2, s.normal, s.front, s.dir, width);
  vec3 n = look.normal;
  scatter(path, sampled, s, look, c, distance, width, started);
  RECORD_FIRST_HIT(path, sampled, ray, hit, n)
}
