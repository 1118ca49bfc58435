// Arithmetic that gives the same bits on every device. It uses sums, differences and products, which Vulkan requires to
// be correctly rounded and which `precise` keeps apart, and integers. Division, sqrt, inversesqrt, sin, cos, dot and
// normalize may round differently on each driver (Vulkan, "Precision and operation of SPIR-V instructions"), so they
// are replaced here.

float exact_dot(vec3 a, vec3 b) {
  precise float sum = a.x * b.x + a.y * b.y + a.z * b.z;
  return sum;
}

vec3 exact_cross(vec3 a, vec3 b) {
  precise vec3 c = vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
  return c;
}

// Returns 1 / sqrt(x) for x in [2^-100, 2^100], to 2 ulp: a guess from the bits (off by 3.5 %) and three Newton steps,
// each of which squares the error. For x = 0 the result is large and finite.
float exact_inverse_sqrt(float x) {
  precise float y = uintBitsToFloat(0x5F375A86u - (floatBitsToUint(x) >> 1));
  precise float h = 0.5 * x;
  y = y * (1.5 - h * y * y);
  y = y * (1.5 - h * y * y);
  y = y * (1.5 - h * y * y);
  return y;
}

// Returns the square root of x in [2^-100, 2^100] or 0.
float exact_sqrt(float x) {
  precise float root = x * exact_inverse_sqrt(x);
  return root;
}

// Returns the power of two that brings a magnitude into [1, 2). Products with it are exact.
float unit_scale(float magnitude) {
  return uintBitsToFloat((254u - clamp(floatBitsToUint(magnitude) >> 23, 1u, 253u)) << 23);
}

float largest(vec3 v) { return max(max(abs(v.x), abs(v.y)), abs(v.z)); }

// Returns v at length 1, to 4 ulp, whatever its length was; zero for zero.
vec3 exact_unit(vec3 v) {
  precise vec3 scaled = v * unit_scale(largest(v));
  precise vec3 unit = scaled * exact_inverse_sqrt(exact_dot(scaled, scaled));
  return unit;
}

// Returns (cos, sin) of 2 pi u for u in [0, 1], to 2^-23, by Taylor series about the nearest quarter turn.
vec2 exact_turn(float u) {
  float quarter = floor(4.0 * u + 0.5);
  precise float x = (u - 0.25 * quarter) * 6.28318531;
  precise float s = x * x;
  precise float c = 1.0 - s * (0.5 - s * (0.0416666667 - s * (0.00138888889 - s * 2.48015873e-5)));
  precise float d = x * (1.0 - s * (0.166666667 - s * (0.00833333333 - s * (1.98412698e-4 - s * 2.75573192e-6))));
  uint q = uint(quarter) & 3u;
  return q == 0u ? vec2(c, d) : q == 1u ? vec2(-d, c) : q == 2u ? vec2(-c, -d) : vec2(d, -c);
}
