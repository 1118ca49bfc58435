#version 460
#extension GL_GOOGLE_include_directive : require
// "bvh8" traversal: every ray by itself, over a compressed tree of eight children a node, which are visited in the
// order of the octant of the ray's direction. What is still to be visited of a node is one entry of the stack. With a
// persistent launch idle lanes take new rays.
//
// Based on:
//   Henri Ylitie, Tero Karras, Samuli Laine. Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs.
//   HPG 2017.
//   Timo Aila, Samuli Laine, Tero Karras. Understanding the Efficiency of Ray Traversal on GPUs - Kepler and Fermi
//   Addendum. NVIDIA Technical Report NVR-2012-02, 2012. ("dynamic fetch")
//
// traverse(walker, live, node) -> node   END_OF_TREE when the ray has ended; otherwise the node at which it continues
//   live   false if the lane has no ray
//   Flow   lanes diverge; the count of a persistent launch sees the lanes that are together; any value is correct
//   Memory STACK_SIZE words per lane, two an entry
//   push.threshold   persistent launch: the subgroup stops for new rays when fewer lanes than this are at work
#define METHOD_WITHOUT_PAIRS
#if BALLOT_LAUNCH == 1
#define METHOD_REFILLS
#endif
#include "../lib/frame/kernel.glsl"
#include "../lib/tree/bvh8.glsl"

const uint GROUPS = STACK_SIZE / 2u;
#if BALLOT_STACK == STACK_SHARED
shared uvec2 group_stacks[GROUPS * gl_WorkGroupSize.x];
#define GROUP_AT(i) group_stacks[(i) * gl_WorkGroupSize.x + gl_LocalInvocationIndex]
#else
uvec2 group_stack[GROUPS];
#define GROUP_AT(i) group_stack[i]
#endif

bool refill_left;  // true while untaken rays are left
// The state of a walk, which outlives a call.
uint stack_top;
Bvh8Group nodes_left, leaves_left;

// Begins at node 0, the only one of its group. The bottom of the stack is a group without children.
void begin_ray() {
  stack_top = 0u;
  GROUP_AT(stack_top++) = uvec2(0u);
  nodes_left = Bvh8Group(0u, 1u);
  leaves_left = Bvh8Group(0u, 0u);
}

// Continues to the nearest inner child, with its siblings on the stack. Pops the stack where the ray meets no child of
// it.
void step_down(Walker w, uint octant) {
  COUNT_NODE(true)
  uint node = take_node(nodes_left, octant);
  Bvh8Group rest = nodes_left;
#if BALLOT_PUSH == PUSH_ALWAYS
  // Entries beyond the top of the stack are ignored.
  uvec2 below = GROUP_AT(stack_top - 1u), left = uvec2(rest.all, rest.hits);
  GROUP_AT(stack_top) = left;
  stack_top += uint(rest.hits != 0u);
  COUNT_STACK(2u * stack_top)
  meet_children(w, node, octant, nodes_left, leaves_left);
  bool none = nodes_left.hits == 0u;
  uvec2 popped = rest.hits != 0u ? left : below;
  stack_top -= uint(none);
  if (none) nodes_left = Bvh8Group(popped.x, popped.y);
#else
  if (rest.hits != 0u) GROUP_AT(stack_top++) = uvec2(rest.all, rest.hits);
  COUNT_STACK(2u * stack_top)
  meet_children(w, node, octant, nodes_left, leaves_left);
  if (nodes_left.hits == 0u) {
    uvec2 popped = GROUP_AT(--stack_top);
    nodes_left = Bvh8Group(popped.x, popped.y);
  }
#endif
}

void meet_leaf(inout Walker w) {
  visit_leaf(w, take_leaf(leaves_left), true);
#if BALLOT_ANY_HIT
  if (HAS_ENDED(w.hit)) nodes_left.hits = leaves_left.hits = 0u;
#endif
}

bool has_left() { return (nodes_left.hits | leaves_left.hits) != 0u; }

// Up to two nodes and one leaf in each iteration: a lane with a leaf waits for few steps of the others, and all lanes
// with leaves test them together.
uint traverse(inout Walker w, bool live, uint node) {
#ifndef METHOD_REFILLS
  begin_ray();
#endif
  if (!live || node == END_OF_TREE) nodes_left.hits = 0u;
  uint octant = octant_of(w);
  while (has_left()) {
    if (leaves_left.hits == 0u) step_down(w, octant);
    if (leaves_left.hits == 0u && nodes_left.hits != 0u) step_down(w, octant);
    if (leaves_left.hits != 0u) meet_leaf(w);
#ifdef METHOD_REFILLS
    if (refill_left && subgroupBallotBitCount(subgroupBallot(has_left())) < push.threshold) break;
#endif
  }
  return has_left() ? node : END_OF_TREE;
}

#include "../lib/frame/main.glsl"
