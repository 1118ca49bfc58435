// What the box tests share.
//
// The rule for direction components: one whose magnitude is below 2^-60 of the largest, zero, negative zero and denormals
// included, counts as that magnitude with its sign (+ for either zero). Over any distance inside the scene this moves the
// ray by less than 2^-59 of the scene's extent. The reciprocal is then finite, never 0 * infinity, so no NaN arises from
// finite boxes; rays with NaN or infinite components are dead (layout.h) and never get here. The largest component is in
// [1, 2) (lib/scale.glsl), so the magnitude is a constant.

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

// 1 / direction by the rule above.
vec3 reciprocal_direction(vec3 dir) {
  const float smallest = 8.67361738e-19;  // 2^-60
  vec3 d = mix(dir, mix(vec3(smallest), vec3(-smallest), lessThan(dir, vec3(0.0))), lessThan(abs(dir), vec3(smallest)));
  precise vec3 inv = 1.0 / d;
  return inv;
}

// From t at both planes of each axis.
vec2 cut_interval(vec3 a, vec3 b, float t_min, float t_max) {
  vec3 near = smaller(a, b), far = larger(a, b);
  return vec2(larger(larger(near.x, near.y), larger(near.z, t_min)),
              smaller(smaller(far.x, far.y), smaller(far.z, t_max)));
}

// The largest distance along an axis between a point of the scene and the ray's origin; rounded, so up to 2^-24 too small.
float scene_reach(vec3 origin) {
  vec3 far = max(abs(push.scene_lo - origin), abs(push.scene_hi - origin));
  return max(far.x, max(far.y, far.z));
}
