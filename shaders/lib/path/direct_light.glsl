// Light sampling at hits, and the sky, for integrators that shade materials.
//
// Light is found in two ways: by light sampling, and by BSDF sampling along the path. Where both can find it, each is
// weighted by the balance heuristic (Veach, Guibas, Optimally Combining Sampling Techniques for Monte Carlo Rendering,
// SIGGRAPH 1995). The integrator defines BSDF_FINDS_LIGHT: 1, if its secondary rays sample the BSDF; 0, if light
// sampling alone finds light.

const float SHORT_OF_LIGHT = 0.9999;  // a shadow ray ends at this fraction of the distance to the light
const float ROUGH_SPREAD = 0.1;       // spread of cones that leave rough surfaces

// The balance heuristic: the weight of a sample of this density, against the other density.
float weigh(float density, float other) { return other > 0.0 ? density / (density + other) : 1.0; }

#if BALLOT_SKY != SKY_NONE
// Returns the weighted radiance of the sky for a ray that leaves the scene. `pdf` as in Carried.
vec3 sky_seen(vec3 dir, float pdf) {
#if AIMS_AT_SKY && BALLOT_SKY == SKY_MAP
  float aimed = pdf > 0.0 ? KIND_CHANCE * map_density(map_pixel(dir, map_size()), map_size()) : 0.0;
  return sky_radiance(dir) * weigh(pdf, aimed);
#else
  return sky_radiance(dir);
#endif
}
#endif

#if HAS_LIGHT
void start_shadow(PixelSample sampled, Surface s, Bsdf b, Carried c, inout Started started) {
  Aim aim = aim_at_something(origin_on(s, 1.0), b.n, draw(sampled, 0u), draw2(sampled, 1u));
  float density;
  vec3 value = eval_bsdf(b, aim.dir, density);
#if BSDF_FINDS_LIGHT
  if (RAY_DEPTH >= push.last_depth) density = 0.0;  // no BSDF sample follows at the last depth
#else
  density = 0.0;
#endif
  started.light = c.throughput * value * aim.radiance * (aim.density > 0.0 ? weigh(aim.density, density) : 1.0);
  started.shadow = dot(aim.dir, s.normal) > 0.0 && luminance(started.light) > 0.0;
  started.shadow_ray = leave(s, 1.0, aim.dir, INFINITELY_FAR);
  if (aim.distance < INFINITELY_FAR) {
    vec3 to = aim.end - started.shadow_ray.origin;
    float far = length(to);
    started.shadow_ray.dir = to / max(far, 1e-30);
    started.shadow_ray.t_max = far * SHORT_OF_LIGHT;
  }
}
#endif
