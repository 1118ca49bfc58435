#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Places: where the list of each query begins if they lie one after the other. A prefix sum in three dispatches: the
// sum of each tile of queries, by one workgroup the sums of the tiles before each, and the places.
//
// Source: Duane Merrill, Andrew Grimshaw. Parallel Scan for Stream Architectures. University of Virginia CS-2009-14
// (reduce, then scan).
//
// A list that is UNFINISHED, UNSURE or too long takes no room. places[lists] is the sum of all. No place is behind the
// room for all, so a list has its place if there are as many records to the next one.
#include "../shared/query.h"

layout(local_size_x = PLACES_GROUP) in;
layout(push_constant, scalar) uniform Push { PlacesPush push; };
layout(set = 0, binding = BIND_CROSSINGS, scalar) readonly buffer Counts { uint counts[]; };
layout(set = 0, binding = BIND_PLACES, scalar) writeonly buffer Places { uint places[]; };
layout(set = 0, binding = BIND_TILES, scalar) buffer Tiles { uint tiles[]; };

shared uint sums[PLACES_GROUP];

// Returns the sum of `mine` over the lanes before this one, and over all.
uint sum_before(uint mine, out uint all) {
  uint lane = gl_LocalInvocationID.x, sum = mine;
  sums[lane] = sum;
  barrier();
  for (uint step = 1u; step < PLACES_GROUP; step *= 2u) {
    uint other = lane >= step ? sums[lane - step] : 0u;
    barrier();
    sum += other;
    sums[lane] = sum;
    barrier();
  }
  all = sums[PLACES_GROUP - 1u];
  return sum - mine;
}

uint room_of(uint i) { return i < push.lists && counts[i] <= push.longest ? counts[i] : 0u; }

// Replaces the sums of tiles by those of the tiles before.
void sum_tiles() {
  uint share = (push.tiles + PLACES_GROUP - 1u) / PLACES_GROUP, first = gl_LocalInvocationID.x * share, mine = 0u, all;
  uint last = min(first + share, push.tiles);
  for (uint i = first; i < last; ++i) mine += tiles[i];
  uint before = sum_before(mine, all);
  for (uint i = first; i < last; ++i) {
    uint own = tiles[i];
    tiles[i] = before;
    before += own;
  }
}

void main() {
  if (push.step == PLACES_SUM) {
    sum_tiles();
    return;
  }
  uint tile = gl_WorkGroupID.x, first = tile * PLACES_TILE + gl_LocalInvocationID.x * PLACES_SHARE, mine = 0u, all;
  for (uint i = 0u; i < PLACES_SHARE; ++i) mine += room_of(first + i);
  uint before = sum_before(mine, all);
  if (push.step == PLACES_TILES) {
    if (gl_LocalInvocationID.x == 0u) tiles[tile] = all;
    return;
  }
  before += tiles[tile];
  for (uint i = 0u; i < PLACES_SHARE; ++i) {
    if (first + i <= push.lists) places[first + i] = min(before, push.records);
    before += room_of(first + i);
  }
}
