#version 460
#extension GL_GOOGLE_include_directive : require
// "dynamic-fetch" traversal: while-while traversal that stops when too few lanes of the subgroup are at work, so that
// the idle lanes get new rays.
//
// Based on:
//   Timo Aila, Samuli Laine, Tero Karras. Understanding the Efficiency of Ray Traversal on GPUs - Kepler and Fermi
//   Addendum. NVIDIA Technical Report NVR-2012-02, 2012.
// Differs from the paper: no leaf is postponed, so the fetch is the only difference from while-while.
//
// traverse(walker, live, node) -> node   END_OF_TREE when the ray has ended; otherwise the node at which it continues
//   live   false if the lane has no ray
//   Flow   lanes diverge; the count sees the lanes that are in the same loop, and any value of it is correct
//   Memory STACK_SIZE words per lane
//   push.threshold   the subgroup stops for new rays when fewer lanes than this are at work
#define METHOD_REFILLS
#include "../lib/frame/kernel.glsl"
#include "../lib/tree/walk.glsl"

bool refill_left;  // true while untaken rays are left
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
    WALK_LEAVES(w, node, top)
    if (refill_left && subgroupBallotBitCount(subgroupBallot(node != END_OF_TREE)) < push.threshold) break;
  }
  stack_top = top;
  return node;
}

#include "../lib/frame/main.glsl"
