// Converts float32 to double and back by their bits, because conversions, products and comparisons of float32 may flush
// denormals.
double widen(float value) {
  uint bits = floatBitsToUint(value), sign = bits & 0x80000000u, e = bits >> 23 & 0xFFu, m = bits & 0x7FFFFFu;
  double one = packDouble2x32(uvec2(m << 29, sign | (max(e, 1u) + 896u) << 20 | m >> 3));
  return e == 0u ? one - packDouble2x32(uvec2(0u, sign | 897u << 20)) : one;
}
dvec3 widen(vec3 v) { return dvec3(widen(v.x), widen(v.y), widen(v.z)); }
float narrow(double value) {
  double size = abs(value);
  if (size >= 1.1754943508222875e-38lf) return float(value);  // 2^-126
  uint bits = uint(size * 713623846352979940529142984724747568191373312.0lf + 0.5lf);  // 2^149
  return uintBitsToFloat(value < 0.0lf ? bits | 0x80000000u : bits);
}

// A finite float32 is a mantissa below 2^24, with its sign, times 2 to its exponent.
uint mantissa_of(uint bits) { return (bits & 0x7FFFFFu) | ((bits & 0x7F800000u) != 0u ? 0x800000u : 0u); }
int exponent_of(uint bits) { return max(int(bits >> 23 & 0xFFu), 1) - 150; }
