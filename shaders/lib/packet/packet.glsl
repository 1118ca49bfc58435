// The parts that packet methods share: the packet's stack, cooperative fetch, the votes, and the walk on the shared
// path.
//
// Everything in this file runs in subgroup-uniform control flow: all lanes of the subgroup arrive, including those
// without a ray.

#include "packet_stack.glsl"

// True if this lane wants the current node. The flag is also kept for the stack, one bit an entry for the first 32
// entries; deeper entries count as wanted. Only for methods that ask for it, and for the counters.
#if BALLOT_COUNTERS || defined(PACKET_REMEMBERS_WANTS)
bool packet_wants;
uint packet_want_bits;
#define PACKET_ENTER(wanted) packet_wants = wanted;
#define PACKET_REMEMBER(wanted) \
  if (packet_top < 32u) packet_want_bits = packet_want_bits & ~(1u << packet_top) | uint(wanted) << packet_top;
#define PACKET_RECALL() packet_wants = packet_top >= 32u || (packet_want_bits >> packet_top & 1u) != 0u;
#else
#define PACKET_ENTER(wanted)
#define PACKET_REMEMBER(wanted)
#define PACKET_RECALL()
#endif

void packet_push(uint node, bool wanted) {
  PACKET_REMEMBER(wanted)
  COUNT_PUSH(packet_top)
  packet_store(packet_top++, node);
  COUNT_STACK(packet_top)
}

uint packet_pop() {
  --packet_top;
  PACKET_RECALL()
  COUNT_NEEDS(packet_wants)
  COUNT_POP(packet_top)
  return packet_entry(packet_top);
}

uint packet_height() { return packet_top - 1u; }  // entries above END_OF_TREE

void packet_begin() {
  packet_top = 0u;
  PACKET_ENTER(true)
  COUNT_SHARED(true)
  packet_push(END_OF_TREE, true);
}

// Loads a pair once for the packet (Vinkler, section 3.1). With BALLOT_COOPERATIVE, four lanes load a texel each and
// hand it round. Without it every lane loads the pair, because lanes that read one address share the load anyway.
Pair packet_fetch_pair(uint node) {
#if BALLOT_COOPERATIVE
  uvec4 mine = node_texel(node + min(gl_SubgroupInvocationID & 3u, PAIR_TEXELS(BALLOT_LAYOUT) - 1u));
  return unpack_pair(subgroupShuffle(mine, 0u), subgroupShuffle(mine, 1u), subgroupShuffle(mine, 2u),
                     subgroupShuffle(mine, 3u));
#else
  return fetch_pair(node);
#endif
}

// The children of a pair that one lane wants to enter.
struct Wish {
  bool left, right, left_nearer;
};

Wish wish_of(Walker w, Pair pair, bool live) {
  float entry_l, entry_r;
  bool l = meets(w, pair.l, entry_l), r = meets(w, pair.r, entry_r);
  COUNT_ENTRIES(entry_l, entry_r)
  return Wish(l && live, r && live, entry_l <= entry_r);
}

// The result of a vote over the wishes of all lanes.
struct Vote {
  bool left, right;     // some lane wants this child
  bool right_first;     // decided by the lanes that want both
  uint lefts, rights;   // lanes that want each child; not with VOTE_ANY
};

#if BALLOT_VOTE == VOTE_SUM
shared uint vote_sums[gl_WorkGroupSize.x];
// Sums two counts, 16 bits each, over the subgroup in log2(subgroup size) rounds.
uint packet_sum(uint mine) {
  uint base = gl_SubgroupID * gl_SubgroupSize, lane = gl_SubgroupInvocationID;
  for (uint step = gl_SubgroupSize / 2u; step > 0u; step /= 2u) {
    vote_sums[base + lane] = mine;
    PACKET_BARRIER();
    mine += vote_sums[base + (lane ^ step)];
    PACKET_BARRIER();
  }
  return mine;
}
#endif

// Returns the number of lanes for which `mine` holds.
uint packet_count(bool mine) {
#if BALLOT_VOTE == VOTE_SUM
  return packet_sum(uint(mine));
#else
  return subgroupBallotBitCount(subgroupBallot(mine));
#endif
}

// Returns true if `mine` holds in some lane.
bool packet_any(bool mine) {
#if BALLOT_VOTE == VOTE_ANY
  return subgroupAny(mine);
#elif BALLOT_VOTE == VOTE_COUNT
  return subgroupBallot(mine) != uvec4(0u);
#else
  return packet_sum(uint(mine)) != 0u;
#endif
}

Vote packet_vote(Wish mine) {
  bool both = mine.left && mine.right;
#if BALLOT_VOTE == VOTE_ANY
  bool l = subgroupAny(mine.left), r = subgroupAny(mine.right);
  return Vote(l, r, !subgroupAny(both && mine.left_nearer), 0u, 0u);
#elif BALLOT_VOTE == VOTE_COUNT
  uvec4 lefts = subgroupBallot(mine.left), rights = subgroupBallot(mine.right);
  uint nearer = subgroupBallotBitCount(subgroupBallot(both && mine.left_nearer));
  return Vote(lefts != uvec4(0u), rights != uvec4(0u), 2u * nearer < subgroupBallotBitCount(lefts & rights),
              subgroupBallotBitCount(lefts), subgroupBallotBitCount(rights));
#else
  uint wants = packet_sum(uint(mine.left) | uint(mine.right) << 16);
  uint order = packet_sum(uint(both) | uint(both && mine.left_nearer) << 16);
  uint lefts = wants & 0xFFFFu, rights = wants >> 16;
  return Vote(lefts != 0u, rights != 0u, 2u * (order >> 16) < (order & 0xFFFFu), lefts, rights);
#endif
}

// Returns true if some lanes want the left child first and others the right child.
bool packet_disagrees(Wish mine) {
  bool left_first = mine.left && (!mine.right || mine.left_nearer), right_first = mine.right && !left_first;
#if BALLOT_VOTE == VOTE_SUM
  uint sums = packet_sum(uint(left_first) | uint(right_first) << 16);
  return (sums & 0xFFFFu) != 0u && sums >> 16 != 0u;
#else
  return packet_any(left_first) && packet_any(right_first);
#endif
}

#ifdef PACKET_COUNTS_DISAGREEMENTS
uint packet_disagreements;
#endif

// Returns the child to continue with and pushes the other child if it is wanted too. Pops the stack if no lane wants
// either.
uint packet_enter(Pair pair, Wish mine, Vote vote) {
  bool right_first = vote.right && (!vote.left || vote.right_first);
  COUNT_DESCENT(right_first)
  if (vote.left && vote.right) packet_push(right_first ? pair.left : pair.right, right_first ? mine.left : mine.right);
  PACKET_ENTER(right_first ? mine.right : mine.left)
  COUNT_NEEDS(packet_wants)
  uint node = right_first ? pair.right : pair.left;
  if (!vote.left && !vote.right) node = packet_pop();
  return node;
}

// Takes a step from an inner node. Returns the next node.
uint packet_step(Walker w, uint node, bool live) {
  COUNT_NODE(live)
  COUNT_USE(live, w.hit.t)
  Pair pair = packet_fetch_pair(node);
  Wish mine = wish_of(w, pair, live);
  COUNT_VOTE(packet_disagrees(mine))
#ifdef PACKET_COUNTS_DISAGREEMENTS
  packet_disagreements += uint(packet_disagrees(mine));
#endif
  return packet_enter(pair, mine, packet_vote(mine));
}

// Visits a leaf. Returns the next node. An any-hit ray with a hit goes along as dead; a packet without live rays is
// done.
uint packet_leaf(inout Walker w, uint node, inout bool live) {
  visit_leaf(w, node, live);
  node = packet_pop();
#if BALLOT_ANY_HIT
  live = live && w.hit.prim == NO_HIT;
  if (!packet_any(live)) node = END_OF_TREE;
#endif
  return node;
}

// Walks the shared path until the stack is empty or `together` is false, which is tested before every node and leaf.
// Loops are nested so that a step from a node does not run the code of a leaf: lavapipe runs both sides of a branch.
#define PACKET_WALK(w, node, live, together)                                        \
  while (node != END_OF_TREE && (together)) {                                       \
    if (is_inner(node)) {                                                           \
      do {                                                                          \
        node = packet_step(w, node, live);                                          \
      } while (is_inner(node) && (together));                                       \
    }                                                                               \
    if (!(together)) break;                                                         \
    if (CAME_TO_LEAF(node)) node = packet_leaf(w, node, live);                      \
  }
