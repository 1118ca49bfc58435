#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Sums: adds the weight of each ray to the entry of each of its hits, or if it has none to the last entry.
//
// The sums are whole numbers of 64 bits, of a unit that engine/answer/sums.h tells, so that their bits do not depend on
// the order: what overflows the low word is carried to the high one, and both words are modulo 2^32.
//
// Kernel configuration:
// BALLOT_SUMS     what an entry belongs to (SUMS_PRIMS, ...)
// BALLOT_WEIGHTS  1: rays have weights, 0: each counts as 1
// One invocation a weight, hit or entry. Weights are taken apart as words, since devices may flush denormal floats.
#include "../shared/query.h"

layout(local_size_x = SUMS_GROUP) in;
layout(push_constant, scalar) uniform Push { SumsPush push; };
layout(set = 0, binding = BIND_HITS, scalar) readonly buffer Hits { uvec4 hits[]; };
layout(set = 0, binding = BIND_SUMS, scalar) buffer Sums { uint sums[]; };  // low and high word of each
layout(set = 0, binding = BIND_SUM_RANGE, scalar) buffer Range { SumRange range; };
#if BALLOT_WEIGHTS
layout(set = 0, binding = BIND_WEIGHTS, scalar) readonly buffer Weights { uint weights[]; };
#endif
#if BALLOT_SUMS != SUMS_PRIMS
// For each placement its first triangle, of all; then the mesh of each.
layout(set = 0, binding = BIND_PRIM_TABLE, scalar) readonly buffer Table { uint table[]; };
#endif

const uint ONE = 0x3F800000u;

uint exponent_of(uint size) { return max(size >> 23, 1u); }

#if BALLOT_WEIGHTS
uint weight_of(uint ray) { return weights[ray * push.weight_step]; }

void find_range(uint i) {
  uint size = weights[i] & 0x7FFFFFFFu;
  if (size >= 0x7F800000u)
    atomicMin(range.wrong, i);
  else if (size > range.largest)
    atomicMax(range.largest, size);
}
#else
uint weight_of(uint ray) { return ONE; }
#endif

// Returns a number times 2^shift, shift from 0 to 63.
uvec2 lifted(uvec2 number, uint shift) {
  if (shift >= 32u) return uvec2(0u, number.x << (shift - 32u));
  return shift == 0u ? number : uvec2(number.x << shift, number.y << shift | number.x >> (32u - shift));
}

uvec2 negated(uvec2 number) {
  uint low = ~number.x + 1u;
  return uvec2(low, ~number.y + uint(low == 0u));
}

// As SumUnit::whole().
uvec2 whole(uint weight) {
  uint size = weight & 0x7FFFFFFFu, digits = size & 0x7FFFFFu;
  if (size >= 0x800000u) digits |= 0x800000u;
  int shift = int(exponent_of(size)) - int(exponent_of(range.largest)) + int(push.lift);
  uvec2 rounded = uvec2(0u);
  if (shift >= 0) {
    rounded = lifted(uvec2(digits, 0u), uint(shift));
  } else if (shift >= -24) {
    uint down = uint(-shift);
    rounded.x = (digits + (1u << (down - 1u)) - 1u + (digits >> down & 1u)) >> down;
  }
  return weight >> 31 == 0u ? rounded : negated(rounded);
}

#if BALLOT_SUMS != SUMS_PRIMS
// Returns the last placement whose first triangle is not behind this one.
uint placement_of(uint prim) {
  uint low = 0u, high = push.placements;
  while (high - low > 1u) {
    uint middle = (low + high) / 2u;
    if (table[middle] <= prim)
      low = middle;
    else
      high = middle;
  }
  return low;
}
#endif

uint entry_of(uint prim) {
#if BALLOT_SUMS == SUMS_PRIMS
  return prim;
#elif BALLOT_SUMS == SUMS_INSTANCES
  return placement_of(prim);
#else
  return table[push.placements + placement_of(prim)];
#endif
}

void add(uint i) {
  uint prim = hits[i].y, ray = i / push.row;
  if (prim == NO_HIT && i % push.row != 0u) return;
  uint entry = prim == NO_HIT ? push.entries : entry_of(prim);
  uvec2 more = whole(weight_of(ray));
  uint carry = 0u;
  if (more.x != 0u) {
    uint before = atomicAdd(sums[2u * entry], more.x);
    carry = uint(before + more.x < before);
  }
  if (more.y + carry != 0u) atomicAdd(sums[2u * entry + 1u], more.y + carry);
}

// Writes a sum as the float64 that is nearest to it, as SumUnit::number().
void end(uint i) {
  uvec2 sum = uvec2(sums[2u * i], sums[2u * i + 1u]);
  if ((sum.x | sum.y) == 0u) return;
  uint sign = sum.y & 0x80000000u;
  if (sign != 0u) sum = negated(sum);
  uint top = sum.y != 0u ? 32u + uint(findMSB(sum.y)) : uint(findMSB(sum.x));
  if (top <= 52u) {
    sum = lifted(sum, 52u - top);
  } else {
    uint down = top - 52u, rest = sum.x & ((1u << down) - 1u), middle = 1u << (down - 1u);
    sum = uvec2(sum.x >> down | sum.y << (32u - down), sum.y >> down);
    if (rest > middle || (rest == middle && (sum.x & 1u) != 0u)) {
      sum.x += 1u;
      sum.y += uint(sum.x == 0u);
    }
  }
  int power = int(top) + int(exponent_of(range.largest)) - 150 - int(push.lift);
  sums[2u * i] = sum.x;
  sums[2u * i + 1u] = (uint(1022 + power) << 20) + sum.y | sign;  // the first digit adds 1 to the exponent
}

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= push.count) return;
  i += push.first;
#if BALLOT_WEIGHTS
  if (push.step == SUMS_RANGE) find_range(i);
#endif
  if (push.step == SUMS_ADD) add(i);
  if (push.step == SUMS_END) end(i);
}
