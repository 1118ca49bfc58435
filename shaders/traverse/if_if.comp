#version 460
#extension GL_GOOGLE_include_directive : require
// "if-if" traversal: every ray by itself; each iteration handles one node or one leaf.
//
// Based on:
//   Marek Vinkler. Traversal methods for GPU ray tracing. Section 3.2.
//   Timo Aila, Samuli Laine. Understanding the Efficiency of Ray Traversal on GPUs. HPG 2009. ("if-if")
// Differs from the paper: the stack may lie in shared memory; a leaf step tests all triangles of the leaf.
//
// traverse(walker, live, node)
//   live   false if the lane has no ray
//   Flow   lanes diverge; no subgroup operations
//   Memory STACK_SIZE words per lane
#include "../lib/frame/kernel.glsl"
#include "../lib/tree/walk.glsl"

void traverse(inout Walker w, bool live, uint node) {
  STACK_DECLARE
  uint top = 0u;
  STACK_AT(top++) = END_OF_TREE;
  if (!live) node = END_OF_TREE;
  WALK_IF_IF(w, node, top)
}

#include "../lib/frame/main.glsl"
