// Counters of the instrumented variant (RayStats in shared/variant.h). In the timed variant every COUNT_ statement
// expands to nothing: the SPIR-V is byte for byte that of sources without these statements, and a test checks that. So
// each statement stands on a line of its own, and nothing else depends on it.
#if BALLOT_COUNTERS
layout(set = 0, binding = BIND_STATS, scalar) writeonly buffer Stats { RayStats ray_stats[]; };

RayStats stats;
bool stats_shared;          // true on a path that the subgroup shares
bool stats_needs;           // true if this lane's ray met the current node when it was entered or pushed
float stats_entry;          // t at which this ray enters the current node
uint stats_depth;           // depth of the current node, on shared paths
uint stats_depths[STACK_SIZE];
float stats_entries[STACK_SIZE];
float stats_left, stats_right, stats_pushed;  // t at which this ray enters the children, and the pushed child

void stats_begin() {
  stats = RayStats(0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u);
  stats_shared = false;
  stats_needs = true;
  stats_entry = stats_pushed = 0.0;
  stats_depth = 0u;
}

// Counts a visit on the shared path in which no lane, or fewer than a quarter, can still find a hit nearer than its t.
void stats_usefulness(bool live, float t) {
  uint lanes = subgroupBallotBitCount(subgroupBallot(live && stats_needs && stats_entry <= t));
  if (subgroupElect()) {
    stats.unneeded += uint(lanes == 0u);
    stats.few += uint(lanes > 0u && lanes * 4u < gl_SubgroupSize);
  }
}

// Counts a step of the subgroup. All lanes that take the step arrive together.
void stats_step(bool live, bool inner) {
  bool needs = live && (!stats_shared || stats_needs);
  uint lanes = subgroupBallotBitCount(subgroupBallot(needs));
  if (subgroupElect()) ++stats.steps;
  if (!live) return;
  if (needs) stats.lanes += lanes;
  if (inner) {
    ++stats.nodes;
    if (needs) ++stats.nodes_needed;
    if (stats_shared) ++stats.packet_nodes;
  } else {
    ++stats.leaves;
    if (needs) ++stats.leaves_needed;
  }
}

#ifdef METHOD_PACKETS
// The counters of each of a lane's rays. While they are in use, `stats` keeps only the stack's high-water mark.
RayStats packet_stats[BALLOT_RAYS];

// Counts a visit of the packet, a step for each ray of a lane. Bits: `looking` the rays that visit, `needing` those
// that need it.
void stats_wide(uint looking, uint needing, bool inner) {
  uint all = 0u;
  for (uint r = 0u; r < BALLOT_RAYS; ++r) all += subgroupBallotBitCount(subgroupBallot((needing >> r & 1u) != 0u));
  if (subgroupBallot(looking != 0u) == uvec4(0u)) return;
  for (uint r = 0u; r < BALLOT_RAYS; ++r) {
    packet_stats[r].steps += uint(subgroupElect());
    uint looks = looking >> r & 1u, needs = needing >> r & 1u;
    packet_stats[r].lanes += needs * (all / BALLOT_RAYS);
    if (inner) {
      packet_stats[r].nodes += looks;
      packet_stats[r].nodes_needed += needs;
      packet_stats[r].packet_nodes += looks;
    } else {
      packet_stats[r].leaves += looks;
      packet_stats[r].leaves_needed += needs;
    }
  }
}

void stats_wide_triangles(uint looking, uint needing, uint count) {
  for (uint r = 0u; r < BALLOT_RAYS; ++r) {
    packet_stats[r].triangles += (looking >> r & 1u) * count;
    packet_stats[r].triangles_tested += (needing >> r & 1u) * count;
  }
}

void stats_wide_begin(uint r) { packet_stats[r] = stats; }

void stats_wide_end(uint r) {
  uint height = stats.stack;
  stats = packet_stats[r];
  stats.stack = height;
}
#endif

#define COUNT_BEGIN() stats_begin();
#define COUNT_WRITE(index) ray_stats[index] = stats;
#define COUNT_NODE(live) stats_step(live, true);
#define COUNT_USE(live, t) stats_usefulness(live, t);
#define COUNT_LEAF(live, count) { stats_step(live, false); if (live) stats.triangles += count; }
#define COUNT_TRIANGLE() ++stats.triangles_tested;
#define COUNT_TRIANGLES(count) stats.triangles_tested += count;
#define COUNT_STACK(height) stats.stack = max(stats.stack, height);
#define COUNT_SHARED(yes) stats_shared = yes;
#define COUNT_NEEDS(yes) stats_needs = yes;
#define COUNT_ENTRIES(l, r) { stats_left = l; stats_right = r; }
#define COUNT_DESCENT(right)                               \
  {                                                        \
    ++stats_depth;                                         \
    stats_entry = right ? stats_right : stats_left;        \
    stats_pushed = right ? stats_left : stats_right;       \
  }
#define COUNT_PUSH(top) { stats_depths[top] = stats_depth; stats_entries[top] = stats_pushed; }
#define COUNT_POP(top) { stats_depth = stats_depths[top]; stats_entry = stats_entries[top]; }
#define COUNT_VOTE(disagree) \
  { uint d = uint(disagree); if (subgroupElect()) { ++stats.votes; stats.disagreements += d; } }
#define COUNT_SWITCH(times, depth) \
  if (subgroupElect()) { stats.switches += times; stats.switch_depth += (times) * (depth); }
#define COUNT_OVERFLOW(yes) { uint o = uint(yes); if (subgroupElect()) stats.overflows += o; }
#define COUNT_FETCH(yes) stats.fetches += uint(yes);
#define COUNT_WIDE(looking, needing, inner) stats_wide(looking, needing, inner);
#define COUNT_WIDE_TRIANGLES(looking, needing, count) stats_wide_triangles(looking, needing, count);
#define COUNT_WIDE_BEGIN(r) stats_wide_begin(r);
#define COUNT_WIDE_END(r) stats_wide_end(r);
#else
#define COUNT_BEGIN()
#define COUNT_WRITE(index)
#define COUNT_NODE(live)
#define COUNT_USE(live, t)
#define COUNT_LEAF(live, count)
#define COUNT_TRIANGLE()
#define COUNT_TRIANGLES(count)
#define COUNT_STACK(height)
#define COUNT_SHARED(yes)
#define COUNT_NEEDS(yes)
#define COUNT_ENTRIES(l, r)
#define COUNT_DESCENT(right)
#define COUNT_PUSH(top)
#define COUNT_POP(top)
#define COUNT_VOTE(disagree)
#define COUNT_SWITCH(times, depth)
#define COUNT_OVERFLOW(yes)
#define COUNT_FETCH(yes)
#define COUNT_WIDE(looking, needing, inner)
#define COUNT_WIDE_TRIANGLES(looking, needing, count)
#define COUNT_WIDE_BEGIN(r)
#define COUNT_WIDE_END(r)
#endif
