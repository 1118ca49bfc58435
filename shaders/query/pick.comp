#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Pick: the beginnings of lists, from where the lists lie whole and in order: as lists again, or as rows that are
// filled up with misses. A lane takes a list.
//
// BALLOT_WIDENS: hits from (distance, prim).
#include "../shared/query.h"

layout(local_size_x = ORDER_GROUP) in;
layout(push_constant, scalar) uniform Push { PickPush push; };
layout(set = 0, binding = BIND_RECORDS, scalar) writeonly buffer Records { uvec4 records[]; };
#if BALLOT_WIDENS
layout(set = 0, binding = BIND_ROWS, scalar) readonly buffer Narrow { uvec2 narrow[]; };

void main() {
  uint lanes = gl_NumWorkGroups.x * ORDER_GROUP;
  for (uint i = gl_GlobalInvocationID.x; i < push.lists; i += lanes) records[i] = uvec4(narrow[i], 0u, 0u);
}
#else
layout(set = 0, binding = BIND_CROSSINGS, scalar) buffer Counts { uint counts[]; };
layout(set = 0, binding = BIND_WHOLE_PLACES, scalar) readonly buffer WholePlaces { uint whole_places[]; };
layout(set = 0, binding = BIND_PLACES, scalar) readonly buffer Places { uint places[]; };
layout(set = 0, binding = BIND_ROWS, scalar) readonly buffer Whole { uvec4 whole[]; };

void main() {
  uint lane = gl_GlobalInvocationID.x;
  if (lane >= push.lists) return;
  uint count = min(counts[lane], push.most), from = whole_places[lane];
  if (push.step == PICK_COUNTS) {
    counts[lane] = count;
  } else if (push.step == PICK_LISTS) {
    uint to = places[lane];
    if (places[lane + 1u] - to != count) return;  // no room
    for (uint i = 0u; i < count; ++i) records[to + i] = whole[from + i];
  } else {
    for (uint i = 0u; i < push.most; ++i)
      records[lane * push.most + i] = i < count ? whole[from + i] : uvec4(0x7F800000u, NO_HIT, 0u, 0u);
  }
}
#endif
