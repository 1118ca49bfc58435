#version 460
#extension GL_GOOGLE_include_directive : require
// "split-count" traversal: a packet until its lanes have wanted different children first more than n times, then every
// ray by itself.
//
// Based on:
//   Marek Vinkler. Traversal methods for GPU ray tracing. Section 3.3 ("counting how many times rays wanted to take
//   different paths").
// Differs from the paper in the same way as stack-max.
//
// traverse(walker, live, node)
//   live   false if the lane has no ray; it still loads and votes
//   Flow   subgroup-uniform until the switch, then lanes diverge
//   Memory STACK_SIZE words per subgroup and STACK_SIZE per lane
//   push.threshold   n; 0 splits at the first disagreement
#define PACKET_COUNTS_DISAGREEMENTS
#include "../lib/frame/kernel.glsl"
#include "../lib/tree/walk.glsl"
#include "../lib/packet/packet.glsl"
#include "../lib/packet/split.glsl"

void traverse(inout Walker w, bool live, uint node) {
  STACK_DECLARE
  uint top = 0u;
  packet_begin();
  packet_disagreements = 0u;
  if (!packet_any(live)) node = END_OF_TREE;
  PACKET_WALK(w, node, live, packet_disagreements <= push.threshold)
  PART(w, node, live, top)
}

#include "../lib/frame/main.glsl"
