// The next floats above and below. Beside zero it is +-1e-37, as devices may take smaller ones for zero.
vec3 next_up(vec3 v) {
  uvec3 bits = floatBitsToUint(v);
  uvec3 up = mix(bits + 1u, bits - 1u, greaterThanEqual(bits, uvec3(0x80000000u)));
  return mix(uintBitsToFloat(up), vec3(1e-37), equal(v, vec3(0.0)));
}
vec3 next_down(vec3 v) { return -next_up(-v); }
