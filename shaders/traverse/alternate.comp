#version 460
#extension GL_GOOGLE_include_directive : require
// "alternate" traversal: packet traversal that hands unpopular nodes to single lanes. When too few lanes want a node,
// those lanes walk its whole subtree first, each by itself. Then the packet goes on with its stack.
//
// Based on:
//   Marek Vinkler. Traversal methods for GPU ray tracing. Section 3.3 ("the straightforward idea").
//   Carsten Benthin, Ingo Wald, Sven Woop, Manfred Ernst, William Mark. Combining Single and Packet-Ray Tracing for
//   Arbitrary Ray Distributions on the Intel MIC Architecture. TVCG 2012. (the condition)
//
// traverse(walker, live, node)
//   live   false if the lane has no ray; it still loads and votes
//   Flow   subgroup-uniform, except in the subtrees that lanes walk by themselves
//   Memory STACK_SIZE words per subgroup and STACK_SIZE per lane
//   push.threshold   lanes that must want a node for the packet to walk it
#define PACKET_REMEMBERS_WANTS
#include "../lib/frame/kernel.glsl"
#include "../lib/tree/walk.glsl"
#include "../lib/packet/packet.glsl"

// Walks the subtree of a node with the rays that want it, each by itself.
void walk_apart(inout Walker w, uint node, bool wants) {
  STACK_DECLARE
  uint top = 0u;
  STACK_AT(top++) = END_OF_TREE;
  if (!wants) node = END_OF_TREE;
  WALK_IF_IF(w, node, top)
}

void traverse(inout Walker w, bool live, uint node) {
  packet_begin();
  if (!packet_any(live)) node = END_OF_TREE;
  bool together = true;  // true at the root
  while (node != END_OF_TREE) {
    if (is_inner(node) && together) {
      do {
        node = packet_step(w, node, live);
        together = packet_count(live && packet_wants) >= push.threshold;
      } while (is_inner(node) && together);
    }
    if (node != END_OF_TREE) {
      if (together) {
        if (CAME_TO_LEAF(node)) node = packet_leaf(w, node, live);
      } else {
        COUNT_SWITCH(1u, stats_depth)
        COUNT_SHARED(false)
        walk_apart(w, node, live && packet_wants);
        COUNT_SHARED(true)
        node = packet_pop();
#if BALLOT_ANY_HIT
        live = live && w.hit.prim == NO_HIT;
        if (!packet_any(live)) node = END_OF_TREE;
#endif
      }
      together = packet_count(live && packet_wants) >= push.threshold;
    }
  }
}

#include "../lib/frame/main.glsl"
