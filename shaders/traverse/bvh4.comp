#version 460
#extension GL_GOOGLE_include_directive : require
// "bvh4" traversal: while-while traversal of every ray by itself, over a tree of four children a node whose boxes take
// a byte a plane. A step fetches twice as many boxes as a step over the binary tree, in as many bytes.
//
// Based on:
//   Holger Dammertz, Johannes Hanika, Alexander Keller. Shallow Bounding Volume Hierarchies for Fast SIMD Ray Tracing
//   of Incoherent Rays. EGSR 2008.
//   Henri Ylitie, Tero Karras, Samuli Laine. Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs.
//   HPG 2017.
//   Timo Aila, Samuli Laine. Understanding the Efficiency of Ray Traversal on GPUs. HPG 2009. ("while-while")
//
// traverse(walker, live, node)
//   live   false if the lane has no ray
//   Flow   lanes diverge; no subgroup operations
//   Memory STACK_SIZE words per lane
#define METHOD_WITHOUT_PAIRS
#include "../lib/frame/kernel.glsl"
#include "../lib/tree/walk.glsl"
#include "../lib/tree/bvh4.glsl"

void traverse(inout Walker w, bool live, uint node) {
  STACK_DECLARE
  uint top = 0u;
  STACK_AT(top++) = END_OF_TREE;
  if (!live) node = END_OF_TREE;
  while (node != END_OF_TREE) {
    while (is_inner(node)) WALK_BVH4(w, node, top)
    WALK_LEAVES(w, node, top)
  }
}

#include "../lib/frame/main.glsl"
