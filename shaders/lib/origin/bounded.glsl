// Origin policy "bounded": an offset that is proved to be enough for watertight and exact arithmetic, and that is at
// least as large as was measured to be enough for the others.
#include "proof.glsl"

// Returns the triangle's extent over its height; down to a quarter of that where the longest edge is opposite v0.
float slenderness(Surface s) {
  precise vec3 a = s.v1 - s.v0, b = s.v2 - s.v0;
  float scale = unit_scale(max(largest(a), largest(b)));  // the products of small edges would underflow
  a *= scale, b *= scale;
  vec3 c = exact_cross(a, b);
  float c_scale = unit_scale(largest(c)), l = max(largest(a), largest(b));
  precise vec3 scaled_c = c * c_scale;
  precise float ratio = l * l * exact_inverse_sqrt(exact_dot(scaled_c, scaled_c)) * c_scale;
  return ratio;
}

// Returns the offset for the triangle tests of modes "plain" and "fast": position_error(), and room for the test
// itself, which grows with the triangle's extent L and with L over its height h. Measured with 86 M rays of seven
// scenes (reflect, refract, ao, diffuse, all views): plain places the plane off by at most 0.43 w L L / h, and by 300 w
// L where h < L / 1000.
float measured_offset(Surface s) {
#if BALLOT_HAS_SHAPES
  if (s.shape) return 0.0;  // all modes with shapes test them by the same arithmetic
#endif
  vec3 extent = max(max(s.v0, s.v1), s.v2) - min(min(s.v0, s.v1), s.v2);
  precise float room = W * largest(extent) * min(16.0 + slenderness(s), 512.0);
#if BALLOT_HAS_INSTANCES
  room *= s.spread;  // the matrix stretches the errors of the mesh's space
#endif
  precise float offset = position_error(s) + room;
  return offset;
}

vec3 origin_towards(Surface s, float side, float cosine) {
  vec3 m = s.normal * side;
  float offset = max(proved_offset(s, m, cosine), measured_offset(s));
  precise vec3 origin = s.position + m * offset;
  return origin;
}

vec3 origin_on(Surface s, float side) { return origin_towards(s, side, 1.0); }

Ray leave(Surface s, float side, vec3 dir, float t_max) {
  return Ray(origin_towards(s, side, side * exact_dot(s.normal, dir)), 0.0, dir, t_max);
}
