#version 460
#extension GL_GOOGLE_include_directive : require
// "bvh4" traversal: every ray by itself, as in while-while, over a tree of four children a node whose boxes take a byte a plane.
// A step fetches twice the boxes of a step over the binary tree with as many bytes.
//
// Based on:
//   Holger Dammertz, Johannes Hanika, Alexander Keller. Shallow Bounding Volume Hierarchies for Fast SIMD Ray Tracing of
//   Incoherent Rays. EGSR 2008.
//   Henri Ylitie, Tero Karras, Samuli Laine. Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs. HPG 2017.
//   Timo Aila, Samuli Laine. Understanding the Efficiency of Ray Traversal on GPUs. HPG 2009. ("while-while")
//
// traverse(walker, live, node) -> node   the walk ends with END_OF_TREE; anything else was cut short by the driver
//   live   false where the lane has no ray
//   Flow   lanes part; no subgroup operation
//   Memory STACK_SIZE words per lane
#define METHOD_QUADS
#include "../lib/frame/kernel.glsl"
#include "../lib/tree/walk.glsl"
#include "../lib/tree/bvh4.glsl"

uint traverse(inout Walker w, bool live, uint node) {
  STACK_DECLARE
  uint top = 0u;
  STACK_AT(top++) = END_OF_TREE;
  if (!live) node = END_OF_TREE;
  while (node != END_OF_TREE) {
    while (is_inner(node)) WALK_QUAD(w, node, top)
    if (CUT_SHORT(is_inner(node))) break;
    WALK_LEAVES(w, node, top)
  }
  return node;
}

#include "../lib/frame/main.glsl"
