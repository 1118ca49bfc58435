// Ray against axis-aligned box, by slabs.
//
// The rule for direction components: one whose magnitude is below 2^-60 of the largest, zero, negative zero and denormals
// included, counts as that magnitude with its sign (+ for either zero). Over any distance inside the scene this moves the
// ray by less than 2^-59 of the scene's extent, which the padding of the watertight mode covers. The reciprocal is then
// finite, never 0 * infinity, so no NaN arises from finite boxes; dead rays (layout.h) never get here.
//
// Monotone: every step rounds, and rounding is monotone, so a box inside another gets an interval inside the other's, exactly.
// Padding is part of the origins, once a ray: (lo - (o + e)) * inv and (hi - (o - e)) * inv.

#if BALLOT_SELECT_MINMAX
// lavapipe's min and max look after NaN, of which there is none here; a comparison and a blend take less. Times as fast, on
// primary rays of conference and sponza, Mesa 22.3.6 and 25.0.7: packet 1.05 to 1.07, while-while 1.04 to 1.10, if-if 1.03
// to 1.11. Integer comparison of the bit patterns was another 1.03 on 22.3.6, but is wrong for negative t_min.
float smaller(float a, float b) { return a < b ? a : b; }
float larger(float a, float b) { return a > b ? a : b; }
vec3 smaller(vec3 a, vec3 b) { return mix(b, a, lessThan(a, b)); }
vec3 larger(vec3 a, vec3 b) { return mix(b, a, greaterThan(a, b)); }
#else
float smaller(float a, float b) { return min(a, b); }
float larger(float a, float b) { return max(a, b); }
vec3 smaller(vec3 a, vec3 b) { return min(a, b); }
vec3 larger(vec3 a, vec3 b) { return max(a, b); }
#endif

struct Slabs {
  vec3 lo_origin, hi_origin, inv;
};

Slabs make_slabs(Ray ray) {
  vec3 a = abs(ray.dir);
  precise float smallest = max(a.x, max(a.y, a.z)) * 8.67e-19;
  vec3 d = mix(ray.dir, mix(vec3(smallest), vec3(-smallest), lessThan(ray.dir, vec3(0.0))), lessThan(a, vec3(smallest)));
  vec3 e = box_padding(ray);
  precise vec3 lo_origin = ray.origin + e, hi_origin = ray.origin - e;
  precise vec3 inv = clamp(1.0 / d, vec3(-1e38), vec3(1e38));
  return Slabs(lo_origin, hi_origin, inv);
}

// The interval of t in which the ray is inside, as [entry, exit], cut to [t_min, t_max]; empty if entry > exit.
vec2 box_interval(Slabs s, vec3 lo, vec3 hi, float t_min, float t_max) {
  precise vec3 a = (lo - s.lo_origin) * s.inv;
  precise vec3 b = (hi - s.hi_origin) * s.inv;
  vec3 near = smaller(a, b), far = larger(a, b);
  return vec2(larger(larger(near.x, near.y), larger(near.z, t_min)),
              smaller(smaller(far.x, far.y), smaller(far.z, t_max)));
}
