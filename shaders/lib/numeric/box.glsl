// The parts that the box tests share.
//
// The rule for small direction components: a component of magnitude below 2^-60, including zero, negative zero and
// denormals, counts as 2^-60 with its own sign (+ for either zero). The largest component is in [1, 2)
// (lib/numeric/ray_scale.glsl), so over any distance inside the scene this moves the ray by less than 2^-59 of the
// scene's extent. The reciprocal is then finite, never 0 * infinity, so no NaN arises from finite boxes. Rays with NaN
// or infinite components are dead (layout.h) and never get here.

#if BALLOT_MINMAX == MINMAX_SELECT
// lavapipe's min and max handle NaN, which does not occur here; a comparison and a blend take less time. Speed-up on
// primary rays of conference and sponza, Mesa 22.3.6 and 25.0.7: packet 1.05 to 1.07, while-while 1.04 to 1.10, if-if
// 1.03 to 1.11.
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

// Returns 1 / direction, by the rule above.
vec3 reciprocal_direction(vec3 dir) {
  const float smallest = 8.67361738e-19;  // 2^-60
  vec3 d = mix(dir, mix(vec3(smallest), vec3(-smallest), lessThan(dir, vec3(0.0))), lessThan(abs(dir), vec3(smallest)));
  precise vec3 inv = 1.0 / d;
  return inv;
}

#if BALLOT_MINMAX == MINMAX_INTEGER
// Compares bit patterns, for GPUs that have a minimum of three integers. The order of the patterns is that of floats,
// but reversed where both are negative. Then the entry comes out too small, or the exit too large, which is safe,
// and hardly matters if t_min >= 0. Other rays meet every box behind their origins: kernels of crossings take floats.
float last_entry(vec3 near) {
  ivec3 n = floatBitsToInt(near);
  return intBitsToFloat(max(max(n.x, n.y), n.z));
}
float first_exit(vec3 far) {
  ivec3 f = floatBitsToInt(far);
  return intBitsToFloat(min(min(f.x, f.y), f.z));
}
#else
float last_entry(vec3 near) { return larger(larger(near.x, near.y), near.z); }
float first_exit(vec3 far) { return smaller(smaller(far.x, far.y), far.z); }
#endif

// Returns the interval [entry, exit] of a box, given t at the entry and the exit of each axis.
vec2 cut_axes(vec3 near, vec3 far, float t_min, float t_max) {
#if BALLOT_MINMAX == MINMAX_INTEGER
  return vec2(max(last_entry(near), t_min), min(first_exit(far), t_max));
#else
  return vec2(larger(larger(near.x, near.y), larger(near.z, t_min)),
              smaller(smaller(far.x, far.y), smaller(far.z, t_max)));
#endif
}

// The same, given t at the two planes of each axis.
vec2 cut_interval(vec3 a, vec3 b, float t_min, float t_max) {
  return cut_axes(smaller(a, b), larger(a, b), t_min, t_max);
}

// The same, given t at the centre and the part of t that the half extents take.
vec2 cut_centred(vec3 middle, vec3 half_way, float t_min, float t_max) {
  return cut_axes(middle - half_way, middle + half_way, t_min, t_max);
}

// Returns a point relative to the origin that boxes are measured from. If that is not zero, the result is off by up to
// 2^-24 of itself.
#if BALLOT_BOX_ORIGIN
vec3 from_box_origin(vec3 p) {
  precise vec3 moved = p - push.box_origin;
  return moved;
}
#else
vec3 from_box_origin(vec3 p) { return p; }
#endif

// Returns the largest distance along an axis between the ray's origin and the origin of boxes.
float box_reach(vec3 origin) {
  vec3 far = abs(from_box_origin(origin));
  return max(far.x, max(far.y, far.z));
}

// Returns the largest distance along an axis between a point of the scene and the ray's origin. It is rounded: up to
// 2^-24 of itself too small.
float scene_reach(vec3 origin) {
  vec3 far = max(abs(push.scene_lo - origin), abs(push.scene_hi - origin));
  return max(far.x, max(far.y, far.z));
}
