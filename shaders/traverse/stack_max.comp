#version 460
#extension GL_GOOGLE_include_directive : require
// "stack-max" traversal: a packet until its stack holds more than k nodes, then every ray by itself.
//
// Based on:
//   Marek Vinkler. Traversal methods for GPU ray tracing. Section 3.3.
// Differs from the paper: a ray copies the shared stack at the switch instead of reading it later on, since the shared stack
// may lie in the lanes' registers, which lanes that have gone their own way cannot read.
//
// traverse(walker, live, node) -> node   the walk ends with END_OF_TREE; anything else was cut short by the driver
//   live   false where the lane has no ray: it still loads and votes
//   Flow   subgroup-uniform until the switch, then lanes part
//   Memory STACK_SIZE words per subgroup and STACK_SIZE per lane
//   push.threshold   k; 0 parts as soon as a node waits
#include "../lib/frame/kernel.glsl"
#include "../lib/tree/walk.glsl"
#include "../lib/packet/packet.glsl"
#include "../lib/packet/split.glsl"

uint traverse(inout Walker w, bool live, uint node) {
  STACK_DECLARE
  uint top = 0u;
  packet_begin();
  if (!packet_any(live)) node = END_OF_TREE;
  PACKET_WALK(w, node, live, packet_height() <= push.threshold)
  PART(w, node, live, top)
  w.truncated = w.truncated || packet_truncated;
  return node;
}

#include "../lib/frame/main.glsl"
