#version 460
#extension GL_GOOGLE_include_directive : require
// "dynamic fetch": while-while traversal that stops when too few lanes of the subgroup are still at work, so that the idle
// ones get new rays.
//
// Based on:
//   Timo Aila, Samuli Laine, Tero Karras. Understanding the Efficiency of Ray Traversal on GPUs - Kepler and Fermi Addendum.
//   NVIDIA Technical Report NVR-2012-02, 2012.
// Differs from the paper: no leaf is postponed, so that the fetch is all that sets it apart from while-while.
//
// traverse(walker, live, node) -> node   END_OF_TREE when the ray has ended; else the node at which it is to go on
//   live   false where the lane has no ray
//   Flow   lanes part; the count sees the lanes that are in the same loop, and any answer of it is right
//   Memory STACK_SIZE words per lane
//   push.threshold   lanes at work below which the subgroup stops for new rays
#define METHOD_REFILLS
#include "../lib/frame/kernel.glsl"
#include "../lib/tree/walk.glsl"

bool refill_left;  // rays wait
STACK_DECLARE      // outlives a call
uint stack_top;

void begin_ray() {
  stack_top = 0u;
  STACK_AT(stack_top++) = END_OF_TREE;
}

uint traverse(inout Walker w, bool live, uint node) {
  uint top = stack_top;
  while (node != END_OF_TREE) {
    while (is_inner(node)) WALK_STEP(w, node, top)
    if (CUT_SHORT(is_inner(node))) break;
    WALK_LEAVES(w, node, top)
    if (refill_left && subgroupBallotBitCount(subgroupBallot(node != END_OF_TREE)) < push.threshold) break;
  }
  stack_top = top;
  return node;
}

#include "../lib/frame/main.glsl"
