// Minima, maxima and unions over the lanes of a subgroup, by the method that BALLOT_REDUCE names. Methods whose lanes
// may have diverged use shuffles: an H200 (580.159.04) reduces integers only over the lanes that are together at the
// moment, even in a loop that all lanes continue. With integer reductions, packet-wide lost hits or never ended. At the
// start of a kernel all lanes are together (frontier: every result was compared).

const float LARGEST = 3.4028234e38;

#if BALLOT_REDUCE == REDUCE_INTEGER
// Maps floats to integers of the same order: hardware that reduces integers in one instruction does not do so with
// floats.
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
// The steps are written out, because lavapipe keeps a loop over them as a loop. lavapipe's ballot and vote go from lane
// to lane through memory, while a union takes three shuffles. Both together make packet-wide 1.05 to 1.2 times as fast
// (22.3.6, sponza and conference).
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
