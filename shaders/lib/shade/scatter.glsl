// Shades a hit for the integrators whitted and path, and starts the secondary rays of the hit.
//
// Light is found in two ways: by light sampling, and by BSDF sampling along the path. Where both can find it, each is
// weighted by the balance heuristic (Veach, Guibas, Optimally Combining Sampling Techniques for Monte Carlo Rendering,
// SIGGRAPH 1995).

const float SHORT_OF_LIGHT = 0.9999;   // a shadow ray ends at this fraction of the distance to the light
const float ROUGH_SPREAD = 0.1;        // spread of cones that leave rough surfaces
const uint ROULETTE_DEPTH = 3u;

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
#if BALLOT_INTEGRATOR == INTEGRATOR_WHITTED
  density = 0.0;  // no BSDF sample finds this light
#else
  if (RAY_DEPTH >= push.last_depth) density = 0.0;  // no BSDF sample follows at the last depth
#endif
  started.light = c.throughput * value * aim.radiance * (aim.density > 0.0 ? weigh(aim.density, density) : 1.0);
  started.shadow = dot(aim.dir, s.normal) > 0.0 && luminance(started.light) > 0.0;
  started.shadow_ray = leave(s, 1.0, aim.dir, min(aim.distance * SHORT_OF_LIGHT, 1e30));
}
#endif

#if BALLOT_INTEGRATOR == INTEGRATOR_PATH
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
#elif BALLOT_HAS_GLOSS
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
  path.radiance += c.throughput * look.m.emissive * weigh(c.pdf, aimed);
#endif
  Bsdf b = bsdf_of(look, s.dir, s.normal, s.front);
#if HAS_LIGHT
  start_shadow(sampled, s, b, c, started);
#endif
#if BALLOT_INTEGRATOR == INTEGRATOR_PATH
  if (RAY_DEPTH < push.last_depth) start_next(sampled, s, b, c, width, started);
#elif BALLOT_HAS_GLOSS
  if (RAY_DEPTH < push.last_depth) start_both(s, b, c, width, started);
#endif
}
