// Floats as unsigned integers of the same order, for atomic minima and maxima.
uvec3 ordered(vec3 v) {
  uvec3 bits = floatBitsToUint(v);
  return mix(bits | 0x80000000u, ~bits, greaterThanEqual(bits, uvec3(0x80000000u)));
}
vec3 unordered(uvec3 v) {
  return uintBitsToFloat(mix(~v, v & 0x7FFFFFFFu, greaterThanEqual(v, uvec3(0x80000000u))));
}
