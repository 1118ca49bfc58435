#version 460
#extension GL_GOOGLE_include_directive : require
// "stack-max" traversal: a packet until its stack holds more than k nodes, then every ray by itself.
//
// Based on:
//   Marek Vinkler. Traversal methods for GPU ray tracing. Section 3.3.
// Differs from the paper: a ray copies the shared stack at the switch instead of reading it later on. The shared stack
// may lie in the registers of the lanes, and lanes that have diverged cannot read it there.
//
// traverse(walker, live, node)
//   live   false if the lane has no ray; it still loads and votes
//   Flow   subgroup-uniform until the switch, then lanes diverge
//   Memory STACK_SIZE words per subgroup and STACK_SIZE per lane
//   push.threshold   k; 0 splits as soon as a node is on the stack
#include "../lib/frame/kernel.glsl"
#include "../lib/tree/walk.glsl"
#include "../lib/packet/packet.glsl"
#include "../lib/packet/split.glsl"

void traverse(inout Walker w, bool live, uint node) {
  STACK_DECLARE
  uint top = 0u;
  packet_begin();
  if (!packet_any(live)) node = END_OF_TREE;
  PACKET_WALK(w, node, live, packet_height() <= push.threshold)
  PART(w, node, live, top)
}

#include "../lib/frame/main.glsl"
