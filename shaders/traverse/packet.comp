#version 460
#extension GL_GOOGLE_include_directive : require
// "packet" traversal: the rays of a subgroup take one path through the tree, over a stack that they share.
//
// Based on:
//   Marek Vinkler. Traversal methods for GPU ray tracing. Section 3.1.
//   Johannes Guenther, Stefan Popov, Hans-Peter Seidel, Philipp Slusallek. Realtime Ray Tracing on GPU with BVH-based
//   Packet Traversal. RT 2007.
// Differs from the paper: the packet is a subgroup of any size. The votes are subgroup operations (any, or an exact
// count by ballot and bit count, which the paper wished for) or, as in 2010, a reduction in shared memory. A ray tests
// a leaf's triangles only if it meets the leaf's own box.
//
// traverse(walker, live, node)
//   live   false if the lane has no ray; it still loads and votes
//   Flow   subgroup-uniform throughout, except in the triangle tests of visit_leaf
//   Memory STACK_SIZE words per subgroup, shared or spread over the lanes
#include "../lib/frame/kernel.glsl"
#include "../lib/packet/packet.glsl"

void traverse(inout Walker w, bool live, uint node) {
  packet_begin();
  if (!packet_any(live)) node = END_OF_TREE;
  PACKET_WALK(w, node, live, true)
}

#include "../lib/frame/main.glsl"
