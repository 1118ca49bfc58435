#version 460
#extension GL_GOOGLE_include_directive : require
// Scatters hits to the places of their rays; with BALLOT_COUNTERS the records of counters, too.
#include "../lib/reorder/frame.glsl"

RECORDS_IN(BIND_HITS, Hits, hits)
layout(set = 0, binding = BIND_REORDER_ORDER, std430) readonly buffer Order { uint order[]; };
RECORDS_OUT(BIND_REORDER_HITS, HitsOut, hits_out)
#if BALLOT_COUNTERS
layout(set = 0, binding = BIND_REORDER_STATS, std430) readonly buffer Stats { uint stats[]; };
layout(set = 0, binding = BIND_REORDER_STATS_OUT, std430) writeonly buffer StatsOut { uint stats_out[]; };
#endif

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= ray_count()) return;
  uint place = push.first + order[i];
  Hit hit = get_hit(hits, i);
  put_part(hits_out, place, hit);
#if BALLOT_COUNTERS
  for (uint word = 0u; word < REORDER_STATS_WORDS; ++word)
    stats_out[REORDER_STATS_WORDS * place + word] = stats[REORDER_STATS_WORDS * i + word];
#endif
}
