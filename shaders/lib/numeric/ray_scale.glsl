// The scale of rays during traversal. Rays are walked with a direction whose largest component lies in [1, 2), scaled
// by a power of two, and with t in these units: whatever the direction's length, reciprocals neither overflow nor
// vanish. Products with powers of two are exact. What may be lost are components below 2^-126 of the largest, t that
// stand for less than 2^-126 scene units, and t_max beyond 2^127 scene units, which reaches across any scene.

// Returns the biased exponent of a direction's largest component, which is at least 2^-126 (is_dead).
uint direction_exponent(vec3 dir) {
  vec3 a = abs(dir);
  return min(floatBitsToUint(max(a.x, max(a.y, a.z))) >> 23, 253u);
}

float direction_scale(vec3 dir) { return uintBitsToFloat((254u - direction_exponent(dir)) << 23); }

#if BALLOT_TRIANGLE == TRIANGLE_EXACT || BALLOT_TRIANGLE == TRIANGLE_DOUBLE
#if BALLOT_TRIANGLE == TRIANGLE_EXACT
#include "float_bits.glsl"
#endif
// Scales in double, so that components below 2^-126 are not lost on devices that flush them.
vec3 scaled_direction(vec3 dir) {
  dvec3 scaled = widen(dir) * packDouble2x32(uvec2(0u, (1150u - direction_exponent(dir)) << 20));
  return vec3(float(scaled.x), float(scaled.y), float(scaled.z));
}
#else
// Scales components that are denormal by their bits, as products of them are zero on devices that flush them.
vec3 scaled_direction(vec3 dir) {
  uvec3 bits = floatBitsToUint(dir);
  uint e = direction_exponent(dir);
  float rest = uintBitsToFloat((128u - min(e, 128u)) << 23);
  precise vec3 of_denormal = vec3(bits & 0x7FFFFFu) * 1.1920929e-7 * rest;  // 2^-23
  of_denormal = uintBitsToFloat(floatBitsToUint(of_denormal) | (bits & 0x80000000u));
  return mix(dir * direction_scale(dir), of_denormal, equal(bits & 0x7F800000u, uvec3(0u)));
}
#endif

Ray scaled_ray(Ray given) {
  float inverse = uintBitsToFloat(direction_exponent(given.dir) << 23);
  return Ray(given.origin, clamp(given.t_min * inverse, -3.4e38, 3.4e38), scaled_direction(given.dir),
             clamp(given.t_max * inverse, -3.4e38, 3.4e38));
}
