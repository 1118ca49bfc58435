#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Order: the lists of queries one after the other, each in order of its records' first word, which is a float, at equal
// ones of the second. Lists that fitted into rows are taken from there, others lie in their places already. Then, if
// asked to, carries all records to other memory, and no more than there are.
//
// Source: Marcin Ciura. Best Increments for the Average Case of Shellsort. Fundamentals of Computation Theory, 2001
// (the steps).
//
// BALLOT_LONG: the lists that are longer than a lane puts in order, by a workgroup each. It compares as for a list that
// is filled up to a power of two with records that come last.
//
// Source: Kenneth Batcher. Sorting Networks and their Applications. AFIPS Spring Joint Computer Conference, 1968.
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
#if BALLOT_LONG
layout(set = 0, binding = BIND_RECORDS, scalar) coherent buffer Records { RECORD records[]; };
#else
layout(set = 0, binding = BIND_ROWS, scalar) readonly buffer Rows { RECORD rows[]; };
layout(set = 0, binding = BIND_RECORDS, scalar) buffer Records { RECORD records[]; };
#endif

bool before(RECORD a, RECORD b) {
  float x = uintBitsToFloat(a.x), y = uintBitsToFloat(b.x);
  return x < y || (x == y && a.y < b.y);
}

#if BALLOT_LONG
shared uint lengths[ORDER_GROUP], long_lists;

void exchange(uint begin, uint count, uint low, uint high) {
  if (high >= count) return;
  RECORD a = records[begin + low], b = records[begin + high];
  if (!before(b, a)) return;
  records[begin + low] = b;
  records[begin + high] = a;
}

// Merges runs of `half` records into those of twice as many: against each other, then in ever smaller steps.
void merge(uint begin, uint count, uint half_run, uint pairs) {
  for (uint step = half_run; step > 0u; step /= 2u) {
    for (uint i = gl_LocalInvocationID.x; i < pairs; i += ORDER_GROUP) {
      uint base = i / step * 2u * step, at = i % step;
      exchange(begin, count, base + at, step == half_run ? base + 2u * step - 1u - at : base + step + at);
    }
    memoryBarrierBuffer();
    barrier();
  }
}

void main() {
  uint lane = gl_LocalInvocationID.x, list = gl_WorkGroupID.x * ORDER_GROUP + lane, length = 0u;
  if (list < push.lists && counts[list] > LONGEST_LIST && counts[list] <= push.longest) {
    length = counts[list];
    if (places[list + 1u] - places[list] != length) length = 0u;
  }
  if (lane == 0u) long_lists = 0u;
  barrier();
  lengths[lane] = length;
  if (length > 0u) atomicAdd(long_lists, 1u);
  barrier();
  if (long_lists == 0u) return;
  for (uint i = 0u; i < ORDER_GROUP; ++i) {
    uint count = lengths[i], half_run = 1u;
    if (count == 0u) continue;
    uint begin = places[gl_WorkGroupID.x * ORDER_GROUP + i], pairs = 1u << findMSB(count - 1u);
    for (; half_run < count; half_run *= 2u) merge(begin, count, half_run, pairs);
  }
}
#else
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
#endif
