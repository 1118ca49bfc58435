#version 460
#extension GL_GOOGLE_include_directive : require
// Scatters the keys of a tile, and their prims, to their places (lib/build/sort.glsl). A subgroup takes keys in the
// order in which they lie, and keys of equal digits keep that order.
#include "../lib/build/sort.glsl"

layout(set = 0, binding = BIND_BUILD_TOTALS, std430) readonly buffer Totals { uint totals[]; };
layout(set = 0, binding = BIND_BUILD_KEYS, std430) readonly buffer Keys { Key keys[]; };
layout(set = 0, binding = BIND_BUILD_PRIMS, std430) readonly buffer Prims { uint prims[]; };
layout(set = 0, binding = BIND_BUILD_KEYS_OUT, std430) writeonly buffer KeysOut { Key keys_out[]; };
layout(set = 0, binding = BIND_BUILD_PRIMS_OUT, std430) writeonly buffer PrimsOut { uint prims_out[]; };

// First the keys of each digit that a subgroup has met, then the place of its first key of the digit.
shared uint places[BUILD_GROUP_SUBGROUPS * BUILD_DIGITS];

// Returns the lanes whose digit is that of this lane. Lanes without a key have no lane.
uvec4 lanes_with(uint digit, bool has_key) {
  uvec4 lanes = subgroupBallot(has_key);
  for (uint bit = 0u; bit < 8u; ++bit) {
    bool set = (digit >> bit & 1u) != 0u;
    uvec4 with = subgroupBallot(set);
    lanes &= set ? with : ~with;
  }
  return lanes;
}

BUILD_MAIN {
  uint lane = lane_of_group(), key_end = key_count();
  if (gl_WorkGroupID.x * TILE >= key_end) return;
  for (uint i = lane; i < BUILD_GROUP_SUBGROUPS * BUILD_DIGITS; i += GROUP_SIZE) places[i] = 0u;
  barrier();
  uint own = gl_SubgroupID * BUILD_DIGITS;
  uint first = gl_WorkGroupID.x * TILE + gl_SubgroupID * SUBGROUP_SIZE * BUILD_TILE_KEYS + gl_SubgroupInvocationID;
  uint ranks[BUILD_TILE_KEYS];
  for (uint k = 0u; k < BUILD_TILE_KEYS; ++k) {
    uint i = first + k * SUBGROUP_SIZE;
    bool has_key = i < key_end;
    uint digit = has_key ? digit_of(keys[i], push.shift) : 0u;
    uvec4 lanes = lanes_with(digit, has_key);
    uint leader = subgroupBallotFindLSB(lanes), before = 0u;
    if (has_key && leader == gl_SubgroupInvocationID)
      before = atomicAdd(places[own + digit], subgroupBallotBitCount(lanes));
    before = subgroupShuffle(before, has_key ? leader : gl_SubgroupInvocationID);
    ranks[k] = before + subgroupBallotExclusiveBitCount(lanes);
  }
  barrier();
  uint sum = 0u;  // of all keys of smaller digits
  for (uint digits = 0u; digits < BUILD_DIGITS; digits += GROUP_SIZE) {
    uint digit = digits + lane, all;
    uint count = digit < BUILD_DIGITS ? totals[digit] : 0u;
    uint place = sum + sum_before(count, all);
    sum += all;
    if (digit >= BUILD_DIGITS) continue;
    place += counts[digit * push.tiles + gl_WorkGroupID.x];
    for (uint s = 0u; s < BUILD_GROUP_SUBGROUPS; ++s) {
      uint met = places[s * BUILD_DIGITS + digit];
      places[s * BUILD_DIGITS + digit] = place;
      place += met;
    }
  }
  barrier();
  for (uint k = 0u; k < BUILD_TILE_KEYS; ++k) {
    uint i = first + k * SUBGROUP_SIZE;
    if (i >= key_end) continue;
    Key key = keys[i];
    uint to = places[own + digit_of(key, push.shift)] + ranks[k];
    keys_out[to] = key;
    prims_out[to] = push.first != 0u ? i : prims[i];
  }
}
