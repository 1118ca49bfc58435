// Ray against axis-aligned box, by slabs.
//
// The rule for direction components: one whose magnitude is below 2^-60 of the largest, zero, negative zero and denormals
// included, counts as that magnitude with its sign (+ for either zero). Over any distance inside the scene this moves the
// ray by less than 2^-59 of the scene's extent, which the padding of the watertight mode covers. The reciprocal is then
// finite, never 0 * infinity, so no NaN arises from finite boxes; dead rays (layout.h) never get here.
//
// Monotone: every step rounds, and rounding is monotone, so a box inside another gets an interval inside the other's, exactly.
// Padding is part of the origins, once a ray: (lo - (o + e)) * inv and (hi - (o - e)) * inv.

struct Slabs {
  vec3 lo_origin, hi_origin, inv;
};

Slabs make_slabs(Ray ray) {
  vec3 a = abs(ray.dir);
  float smallest = max(a.x, max(a.y, a.z)) * 8.67e-19;
  vec3 d = mix(ray.dir, mix(vec3(smallest), vec3(-smallest), lessThan(ray.dir, vec3(0.0))), lessThan(a, vec3(smallest)));
  vec3 e = box_padding(ray);
  Slabs s;
  s.lo_origin = ray.origin + e;
  s.hi_origin = ray.origin - e;
  s.inv = clamp(1.0 / d, vec3(-1e38), vec3(1e38));
  return s;
}

// The interval of t in which the ray is inside, as [entry, exit], cut to [t_min, t_max]; empty if entry > exit.
vec2 box_interval(Slabs s, vec3 lo, vec3 hi, float t_min, float t_max) {
  precise vec3 a = (lo - s.lo_origin) * s.inv;
  precise vec3 b = (hi - s.hi_origin) * s.inv;
  vec3 near = min(a, b), far = max(a, b);
  return vec2(max(max(near.x, near.y), max(near.z, t_min)), min(min(far.x, far.y), min(far.z, t_max)));
}
