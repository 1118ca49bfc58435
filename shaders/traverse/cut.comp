#version 460
#extension GL_GOOGLE_include_directive : require
// "cut" traversal: a packet over the nodes that many lanes want. A node that fewer want goes to lists of those lanes, and when
// the packet is done, every ray walks by itself what is on its list.
//
// Based on:
//   Marek Vinkler. Traversal methods for GPU ray tracing. Section 3.3.
// Differs from the paper: the lists are bounded. The depth of the tree does not bound them, so there is an overflow rule: when
// the list of a lane that wants the node is full, the packet walks the node itself.
//
// traverse(walker, live, node) -> node   the walk ends with END_OF_TREE; anything else was cut short by the driver
//   live   false where the lane has no ray: it still loads and votes
//   Flow   subgroup-uniform until the shared stack is empty, then lanes part
//   Memory STACK_SIZE words per subgroup and STACK_SIZE + LIST_SIZE per lane
//   push.threshold   lanes that must want a node for the packet to walk it
#include "../lib/kernel.glsl"
#include "../lib/walk.glsl"
#include "../lib/packet.glsl"

// Whether a child that `lanes` lanes want is put aside, and if so, does it. full: this lane's list is.
#define PUT_ASIDE(child, wanted, lanes, top, aside)                               \
  aside = lanes > 0u && lanes < push.threshold;                                   \
  if (aside) {                                                                    \
    bool overflows = packet_any(wanted && top > LIST_SIZE);                       \
    COUNT_OVERFLOW(overflows)                                                     \
    aside = !overflows;                                                           \
    if (aside && wanted) STACK_AT(top++) = child;                                 \
    COUNT_STACK(top)                                                              \
  }

uint traverse(inout Walker w, bool live, uint node) {
  STACK_DECLARE
  uint top = 0u;
  STACK_AT(top++) = END_OF_TREE;
  packet_begin();
  if (!packet_any(live)) node = END_OF_TREE;
  while (node != END_OF_TREE) {
    if (is_inner(node)) {
      do {
        COUNT_NODE(live)
        Pair pair = packet_fetch_pair(node);
        Wish mine = wish_of(w, pair, live);
        COUNT_VOTE(packet_disagrees(mine))
        Vote vote = packet_vote(mine);
        bool left_aside, right_aside;
        PUT_ASIDE(pair.left, mine.left, vote.lefts, top, left_aside)
        PUT_ASIDE(pair.right, mine.right, vote.rights, top, right_aside)
        vote.left = vote.left && !left_aside;
        vote.right = vote.right && !right_aside;
        node = packet_enter(pair, mine, vote);
      } while (is_inner(node));
    }
    if (is_inner(node)) break;  // only where the driver cut the loop short
    if (node != END_OF_TREE) node = packet_leaf(w, node, live);
  }
  bool cut_short = node != END_OF_TREE;
  COUNT_SWITCH()
  COUNT_SHARED(false)
  node = live ? STACK_AT(--top) : END_OF_TREE;
  WALK_IF_IF(w, node, top)
  w.truncated = w.truncated || packet_truncated || cut_short;
  return node;
}

#include "../lib/main.glsl"
