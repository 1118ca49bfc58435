// Minima, maxima and unions over the lanes of a subgroup, by BALLOT_REDUCE. Where lanes may have parted, by shuffles: in a loop
// whose lanes all go on an H200 (580.159.04) reduces integers over those that are together at the moment, so that packet-wide lost
// hits or never ended. At the start of a kernel they are together (frontier: every answer was compared).

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
uint lanes_min(uint x) { return subgroupMin(x); }
uint lanes_or(uint x) { return subgroupOr(x); }
bool lanes_any(uint x) { return subgroupBallot(x != 0u) != uvec4(0u); }
#else
// Steps are written out: lavapipe keeps a loop over them as a loop. Its ballot and its vote go from lane to lane through memory;
// a union takes three shuffles. Both together: packet-wide 1.05 to 1.2 times as fast (22.3.6, sponza and conference).
#define FOLD_LANES(x, with)                                             \
  if (SUBGROUP_SIZE > 1u) x = with(x, subgroupShuffleXor(x, 1u));       \
  if (SUBGROUP_SIZE > 2u) x = with(x, subgroupShuffleXor(x, 2u));       \
  if (SUBGROUP_SIZE > 4u) x = with(x, subgroupShuffleXor(x, 4u));       \
  if (SUBGROUP_SIZE > 8u) x = with(x, subgroupShuffleXor(x, 8u));       \
  if (SUBGROUP_SIZE > 16u) x = with(x, subgroupShuffleXor(x, 16u));     \
  if (SUBGROUP_SIZE > 32u) x = with(x, subgroupShuffleXor(x, 32u));     \
  if (SUBGROUP_SIZE > 64u) x = with(x, subgroupShuffleXor(x, 64u));
float lanes_min(float x) {
  FOLD_LANES(x, smaller)
  return x;
}
uint lanes_min(uint x) {
  FOLD_LANES(x, min)
  return x;
}
uint union_of(uint a, uint b) { return a | b; }
uint lanes_or(uint x) {
  FOLD_LANES(x, union_of)
  return x;
}
bool lanes_any(uint x) { return lanes_or(x) != 0u; }
#endif
float lanes_max(float x) { return -lanes_min(-x); }
vec3 lanes_min(vec3 v) { return vec3(lanes_min(v.x), lanes_min(v.y), lanes_min(v.z)); }
vec3 lanes_max(vec3 v) { return -lanes_min(-v); }
