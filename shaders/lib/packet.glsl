// What packet methods share: the packet's stack, cooperative fetch, and the votes.
//
// Everything named here runs in subgroup-uniform control flow: all lanes of the subgroup arrive, those without a ray too.

#if BALLOT_SUBGROUP_BARRIER
#define PACKET_BARRIER() subgroupBarrier()
#else
// lavapipe runs a subgroup barrier as a workgroup barrier and loses subgroups that left the loop.
#define PACKET_BARRIER() subgroupMemoryBarrierShared()
#endif

bool packet_truncated;  // the driver left a loop of a vote early: nothing that followed can be trusted

// The stack: child references, END_OF_TREE at the bottom; STACK_SIZE as in lib/walk.glsl.
#if BALLOT_PACKET_STACK == PACKET_STACK_LANES
// Entry i lies in lane i % SUBGROUP_SIZE, word i / SUBGROUP_SIZE.
const uint PACKET_WORDS = (STACK_SIZE + SUBGROUP_SIZE - 1u) / SUBGROUP_SIZE;
uint packet_words[PACKET_WORDS];
uint packet_top;
void packet_push(uint node) {
  for (uint i = 0u; i < PACKET_WORDS; ++i)
    packet_words[i] = i * SUBGROUP_SIZE + gl_SubgroupInvocationID == packet_top ? node : packet_words[i];
  ++packet_top;
}
uint packet_pop() {
  --packet_top;
  uint word = packet_words[0];
  for (uint i = 1u; i < PACKET_WORDS; ++i) word = packet_top >= i * SUBGROUP_SIZE ? packet_words[i] : word;
  return subgroupShuffle(word, packet_top % SUBGROUP_SIZE);
}
#else
shared uint packet_stacks[STACK_SIZE * GROUP_SUBGROUPS];
uint packet_top;
void packet_push(uint node) {
  if (subgroupElect()) packet_stacks[gl_SubgroupID * STACK_SIZE + packet_top] = node;
  ++packet_top;
  PACKET_BARRIER();
}
uint packet_pop() { return packet_stacks[gl_SubgroupID * STACK_SIZE + --packet_top]; }
#endif

void packet_begin() {
  packet_top = 0u;
  packet_truncated = false;
  packet_push(END_OF_TREE);
}

// Each pair is loaded once for the packet (Vinkler, section 3.1): four lanes load a texel each and hand it round, or, where
// lanes that ask for one address share the load anyway, every lane asks.
Pair packet_fetch_pair(uint node) {
#if BALLOT_COOPERATIVE
  uvec4 mine = node_texel(node + (gl_SubgroupInvocationID & 3u));
  return unpack_pair(subgroupShuffle(mine, 0u), subgroupShuffle(mine, 1u), subgroupShuffle(mine, 2u),
                     subgroupShuffle(mine, 3u));
#else
  return fetch_pair(node);
#endif
}

struct Vote {
  bool left, right;  // somebody wants this child
  bool right_first;  // of those who want both
};

#if BALLOT_VOTE == VOTE_SUM
shared uint vote_sums[gl_WorkGroupSize.x];
// Adds up two counts, 16 bits each, over the subgroup in log2(subgroup size) rounds.
uint packet_sum(uint mine) {
  uint base = gl_SubgroupID * gl_SubgroupSize, lane = gl_SubgroupInvocationID;
  uint step = gl_SubgroupSize / 2u;
  for (; step > 0u; step /= 2u) {
    vote_sums[base + lane] = mine;
    PACKET_BARRIER();
    mine += vote_sums[base + (lane ^ step)];
    PACKET_BARRIER();
  }
  packet_truncated = packet_truncated || step > 0u;
  return mine;
}
#endif

bool packet_any(bool mine) {
#if BALLOT_VOTE == VOTE_ANY
  return subgroupAny(mine);
#elif BALLOT_VOTE == VOTE_COUNT
  return subgroupBallot(mine) != uvec4(0u);
#else
  return packet_sum(uint(mine)) != 0u;
#endif
}

Vote packet_vote(bool left, bool right, bool left_nearer) {
#if BALLOT_VOTE == VOTE_ANY
  bool l = subgroupAny(left), r = subgroupAny(right);
  return Vote(l, r, !subgroupAny(left && right && left_nearer));
#elif BALLOT_VOTE == VOTE_COUNT
  uvec4 lefts = subgroupBallot(left), rights = subgroupBallot(right);
  bool l = lefts != uvec4(0u), r = rights != uvec4(0u);
  uint both = subgroupBallotBitCount(lefts & rights);
  uint nearer = subgroupBallotBitCount(subgroupBallot(left && right && left_nearer));
  return Vote(l, r, 2u * nearer < both);
#else
  uint wants = packet_sum(uint(left) | uint(right) << 16);
  uint order = packet_sum(uint(left && right) | uint(left && right && left_nearer) << 16);
  return Vote((wants & 0xFFFFu) != 0u, wants >> 16 != 0u, 2u * (order >> 16) < (order & 0xFFFFu));
#endif
}
