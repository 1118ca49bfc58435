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
//
// PLACES_APPENDED: the lists lie behind those of earlier dispatches, whose sum is in `appended`; `offsets` has where
// each begins, whatever the room. Sums have 64 bits, low word first.
// PLACES_HITS: a list is a hit, or nothing: hits go to their places, each with the number of its query.
#include "../shared/query.h"

layout(local_size_x = PLACES_GROUP) in;
layout(push_constant, scalar) uniform Push { PlacesPush push; };
#if BALLOT_PLACES == PLACES_LISTS
#define SUM uint
#else
#define SUM uvec2
#endif
#if BALLOT_PLACES == PLACES_HITS
layout(set = 0, binding = BIND_HITS, scalar) readonly buffer Hits { uvec4 hits[]; };
layout(set = 0, binding = BIND_RECORDS, scalar) writeonly buffer Records { uvec4 records[]; };
layout(set = 0, binding = BIND_CROSSINGS, scalar) writeonly buffer Numbers { uint numbers[]; };
#else
layout(set = 0, binding = BIND_CROSSINGS, scalar) readonly buffer Counts { uint counts[]; };
layout(set = 0, binding = BIND_PLACES, scalar) writeonly buffer Places { uint places[]; };
#endif
layout(set = 0, binding = BIND_TILES, scalar) buffer Tiles { SUM tiles[]; };
#if BALLOT_PLACES == PLACES_APPENDED
layout(set = 0, binding = BIND_OFFSETS, scalar) writeonly buffer Offsets { uvec2 offsets[]; };
#endif

#if BALLOT_PLACES == PLACES_LISTS
#define ZERO 0u
#define ADD(to, more) to += more
#define LESS(sum, less) sum - less
#define IN_ROOM(sum) min(sum, push.records)
#else
layout(set = 0, binding = BIND_APPENDED, scalar) buffer Appended { AppendedLists appended; };

uvec2 plus(uvec2 a, uvec2 b) {
  uint carry, low = uaddCarry(a.x, b.x, carry);
  return uvec2(low, a.y + b.y + carry);
}

uvec2 less(uvec2 a, uvec2 b) {
  uint borrow, low = usubBorrow(a.x, b.x, borrow);
  return uvec2(low, a.y - b.y - borrow);
}

#define ZERO uvec2(0u)
#define ADD(to, more) to = plus(to, uvec2(more))
#define LESS(sum, minus) less(sum, minus)
#define IN_ROOM(sum) (sum.y == 0u ? min(sum.x, push.records) : push.records)
#endif

shared SUM sums[PLACES_GROUP];

// Returns the sum of `mine` over the lanes before this one, and over all.
SUM sum_before(SUM mine, out SUM all) {
  uint lane = gl_LocalInvocationID.x;
  SUM sum = mine;
  sums[lane] = sum;
  barrier();
  for (uint step = 1u; step < PLACES_GROUP; step *= 2u) {
    SUM other = lane >= step ? sums[lane - step] : ZERO;
    barrier();
    ADD(sum, other);
    sums[lane] = sum;
    barrier();
  }
  all = sums[PLACES_GROUP - 1u];
  return LESS(sum, mine);
}

#if BALLOT_PLACES == PLACES_LISTS
uint room_of(uint i) { return i < push.lists && counts[i] <= push.longest ? counts[i] : 0u; }
#elif BALLOT_PLACES == PLACES_APPENDED
uvec2 room_of(uint i) { return uvec2(i < push.lists ? counts[i] : 0u, 0u); }
#else
uvec2 room_of(uint i) { return uvec2(i < push.lists && hits[i].y != NO_HIT ? 1u : 0u, 0u); }
#endif

// Replaces the sums of tiles by those of the tiles before.
void sum_tiles() {
  uint share = (push.tiles + PLACES_GROUP - 1u) / PLACES_GROUP, first = gl_LocalInvocationID.x * share;
  SUM mine = ZERO, all;
  uint last = min(first + share, push.tiles);
  for (uint i = first; i < last; ++i) ADD(mine, tiles[i]);
  SUM before = sum_before(mine, all);
#if BALLOT_PLACES != PLACES_LISTS
  uvec2 earlier = uvec2(appended.low, appended.high), now = plus(earlier, all);
  barrier();
  if (gl_LocalInvocationID.x == 0u) {
    appended.low = now.x;
    appended.high = now.y;
  }
  ADD(before, earlier);
#endif
  for (uint i = first; i < last; ++i) {
    SUM own = tiles[i];
    tiles[i] = before;
    ADD(before, own);
  }
}

void main() {
  if (push.step == PLACES_SUM) {
    sum_tiles();
    return;
  }
  uint tile = gl_WorkGroupID.x, first = tile * PLACES_TILE + gl_LocalInvocationID.x * PLACES_SHARE;
  SUM mine = ZERO, all;
  for (uint i = 0u; i < PLACES_SHARE; ++i) ADD(mine, room_of(first + i));
  SUM before = sum_before(mine, all);
  if (push.step == PLACES_TILES) {
    if (gl_LocalInvocationID.x == 0u) tiles[tile] = all;
#if BALLOT_PLACES == PLACES_APPENDED
    for (uint i = first; i < min(first + PLACES_SHARE, push.lists); ++i)
      if (counts[i] > push.longest) atomicMax(appended.longest, counts[i]);
#endif
    return;
  }
  ADD(before, tiles[tile]);
  for (uint i = 0u; i < PLACES_SHARE; ++i) {
#if BALLOT_PLACES == PLACES_HITS
    bool is_hit = room_of(first + i).x != 0u;
    if (is_hit && IN_ROOM(before) < push.records) {
      records[before.x] = hits[first + i];
      numbers[before.x] = (first + i) / push.longest;
    }
#else
    if (first + i <= push.lists) places[first + i] = IN_ROOM(before);
#if BALLOT_PLACES == PLACES_APPENDED
    if (first + i <= push.lists) offsets[first + i] = before;
#endif
#endif
    ADD(before, room_of(first + i));
  }
}
