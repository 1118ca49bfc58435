#version 460
#extension GL_GOOGLE_include_directive : require
// "cut" traversal: a packet over the nodes that many lanes want. A node that fewer lanes want goes to the lists of
// those lanes. When the packet is done, every ray walks the nodes on its own list by itself.
//
// Based on:
//   Marek Vinkler. Traversal methods for GPU ray tracing. Section 3.3.
// Differs from the paper: the lists are bounded. The depth of the tree does not bound them, so there is an overflow
// rule: when the list of a lane has no room for what the lane wants, the packet walks the node and its sibling itself.
//
// traverse(walker, live, node)
//   live   false if the lane has no ray; it still loads and votes
//   Flow   subgroup-uniform until the shared stack is empty, then lanes diverge
//   Memory STACK_SIZE words per subgroup and STACK_SIZE + LIST_SIZE per lane
//   push.threshold   lanes that must want a node for the packet to walk it
#include "../lib/frame/kernel.glsl"
#include "../lib/tree/walk.glsl"
#include "../lib/packet/packet.glsl"

// Puts the nearer child last, so that the ray takes it first. Stores the child whether it is wanted or not, because a
// branch would cost more.
#define PUT_ASIDE(child, wanted) \
  STACK_AT(top) = child;         \
  top += uint(wanted);

void traverse(inout Walker w, bool live, uint node) {
  STACK_DECLARE
  uint top = 0u;
  STACK_AT(top++) = END_OF_TREE;
  packet_begin();
  if (!packet_any(live)) node = END_OF_TREE;
  while (node != END_OF_TREE) {
    if (is_inner(node)) {
      do {
        COUNT_NODE(live)
        COUNT_USE(live, w.hit.t)
        Pair pair = packet_fetch_pair(node);
        Wish mine = wish_of(w, pair, live);
        COUNT_VOTE(packet_disagrees(mine))
        Vote vote = packet_vote(mine);
        bool few_left = vote.left && vote.lefts < push.threshold,
             few_right = vote.right && vote.rights < push.threshold;
        if (few_left || few_right) {
          bool put_left = mine.left && few_left, put_right = mine.right && few_right;
          bool overflows =
              packet_any((put_left || put_right) && top + uint(put_left) + uint(put_right) > LIST_SIZE + 1u);
          COUNT_OVERFLOW(overflows)
          if (!overflows) {
            COUNT_SWITCH(uint(few_left) + uint(few_right), stats_depth + 1u)
            PUT_ASIDE(mine.left_nearer ? pair.right : pair.left, mine.left_nearer ? put_right : put_left)
            PUT_ASIDE(mine.left_nearer ? pair.left : pair.right, mine.left_nearer ? put_left : put_right)
            vote.left = vote.left && !few_left;
            vote.right = vote.right && !few_right;
          }
          COUNT_STACK(top)
        }
        node = packet_enter(pair, mine, vote);
      } while (is_inner(node));
    }
    if (CAME_TO_LEAF(node)) node = packet_leaf(w, node, live);
  }
  COUNT_SHARED(false)
  node = live ? STACK_AT(--top) : END_OF_TREE;
  WALK_IF_IF(w, node, top)
}

#include "../lib/frame/main.glsl"
