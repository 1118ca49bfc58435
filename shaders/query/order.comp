#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Order: the lists of queries one after the other, each in order of its records' first word, which is a float, at equal
// ones of the second. Lists that fitted into rows are taken from there, others lie in their places already. Then, if
// asked to, carries all records to other memory, and no more than there are.
//
// Source: Marcin Ciura. Best Increments for the Average Case of Shellsort. Fundamentals of Computation Theory, 2001
// (the steps).
#include "../shared/query.h"

#if BALLOT_RECORD_WORDS == 4
#define RECORD uvec4
#else
#define RECORD uvec2
#endif

layout(local_size_x = ORDER_GROUP) in;
layout(push_constant, scalar) uniform Push { OrderPush push; };
layout(set = 0, binding = BIND_CROSSINGS, scalar) readonly buffer Counts { uint counts[]; };
layout(set = 0, binding = BIND_PLACES, scalar) readonly buffer Places { uint places[]; };
layout(set = 0, binding = BIND_ROWS, scalar) readonly buffer Rows { RECORD rows[]; };
layout(set = 0, binding = BIND_RECORDS, scalar) buffer Records { RECORD records[]; };

bool before(RECORD a, RECORD b) {
  float x = uintBitsToFloat(a.x), y = uintBitsToFloat(b.x);
  return x < y || (x == y && a.y < b.y);
}

// Puts a record where it belongs among those of a list that lie `step` apart and before number i.
void insert(uint begin, uint i, uint step, RECORD record) {
  uint to = i;
  while (to >= step && before(record, records[begin + to - step])) {
    records[begin + to] = records[begin + to - step];
    to -= step;
  }
  records[begin + to] = record;
}

void main() {
  uint lane = gl_GlobalInvocationID.x;
  if (push.step == ORDER_CARRY) {
    // Rows are the records, and records the other memory.
    uint all = places[push.lists], lanes = gl_NumWorkGroups.x * ORDER_GROUP;
    for (uint i = lane; i < all; i += lanes) records[i] = rows[i];
    return;
  }
  if (lane >= push.lists) return;
  uint count = counts[lane], begin = places[lane];
  if (count > push.longest || places[lane + 1u] - begin != count) return;
  if (count <= push.row) {
    for (uint i = 0u; i < count; ++i) insert(begin, i, 1u, rows[lane * push.row + i]);
    return;
  }
  const uint steps[8] = {1u, 4u, 10u, 23u, 57u, 132u, 301u, 701u};
  for (int k = 7; k >= 0; --k)
    for (uint i = steps[k]; i < count; ++i) insert(begin, i, steps[k], records[begin + i]);
}
