// Minima and maxima over the lanes of a subgroup, by BALLOT_REDUCE.

const float LARGEST = 3.4028234e38;

#if BALLOT_REDUCE == REDUCE_INTEGER
// Integers in the order of floats; hardware that reduces integers in one instruction does not do so with floats.
int order_of(float x) {
  int i = floatBitsToInt(x);
  return i ^ (i >> 31 & 0x7FFFFFFF);
}
float lanes_min(float x) {
  int i = subgroupMin(order_of(x));
  return intBitsToFloat(i ^ (i >> 31 & 0x7FFFFFFF));
}
#else
float lanes_min(float x) {
  for (uint step = SUBGROUP_SIZE / 2u; step > 0u; step /= 2u) x = smaller(x, subgroupShuffleXor(x, step));
  return x;
}
#endif
float lanes_max(float x) { return -lanes_min(-x); }
vec3 lanes_min(vec3 v) { return vec3(lanes_min(v.x), lanes_min(v.y), lanes_min(v.z)); }
vec3 lanes_max(vec3 v) { return -lanes_min(-v); }
