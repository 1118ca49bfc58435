#version 460
#extension GL_GOOGLE_include_directive : require
// "bvh4-turns" traversal: every ray by itself over the tree of "bvh4", with all lanes of the subgroup in every step.
// Steps to a node and tests of two triangles take turns. A lane that wants the other waits until a count of the lanes
// ends the turn. Idle lanes take new rays.
//
// The loops are uniform, which is what a device gains that masks lanes by instructions, such as lavapipe: it stores
// lane by lane, and branches on each lane's mask, which the processor predicts where the mask never changes.
//
// Based on:
//   Holger Dammertz, Johannes Hanika, Alexander Keller. Shallow Bounding Volume Hierarchies for Fast SIMD Ray Tracing
//   of Incoherent Rays. EGSR 2008.
//   Timo Aila, Samuli Laine, Tero Karras. Understanding the Efficiency of Ray Traversal on GPUs - Kepler and Fermi
//   Addendum. NVIDIA Technical Report NVR-2012-02, 2012. ("dynamic fetch")
//
// traverse(walker, live, node) -> node   END_OF_TREE when the ray has ended; otherwise the node at which it continues
//   live   false if the lane has no ray
//   Flow   uniform; a count sees the lanes that are together; any value is correct
//   Memory STACK_SIZE words per lane
//   push.threshold   the subgroup stops for new rays when fewer lanes than this are at work
#define METHOD_WITHOUT_PAIRS
#define METHOD_REFILLS
#define METHOD_TURNS
#include "../lib/frame/kernel.glsl"
#include "../lib/tree/walk.glsl"
#include "../lib/tree/bvh4.glsl"
#include "../lib/frame/lanes.glsl"

bool refill_left;  // true while untaken rays are left
// The state of a walk, which outlives a call.
STACK_DECLARE
uint stack_top;  // at least 1: waiting lanes read the entry below it
uint tested;     // triangles of the current leaf that have been tested

void begin_ray() {
  STACK_AT(0u) = END_OF_TREE;
  stack_top = 1u;
  tested = 0u;
}

bool is_at_leaf(uint node) { return !is_inner(node) && node != END_OF_TREE; }

uint sum_of(uint a, uint b) { return a + b; }
uint count_lanes(bool yes) {
  uint count = uint(yes);
  FOLD_LANES(count, sum_of)
  return count;
}
// A turn ends when at most this many lanes could go on.
const uint FEW = SUBGROUP_SIZE / 8u;

// Takes a step to the children of a node. Lanes without one go along; what they write above the top of the stack is
// never read.
void step_down(Walker w, inout uint node) {
  COUNT_NODE(is_inner(node))
  uvec4 child = uvec4(node);
  uint met = 1u;
  if (is_inner(node)) met = met_children(w, node, child);
#if BALLOT_PUSH == PUSH_ALWAYS
  uint popped = STACK_AT(stack_top - 1u);
  STACK_AT(stack_top) = child.w;
  stack_top += uint(met > 3u);
  STACK_AT(stack_top) = child.z;
  stack_top += uint(met > 2u);
  STACK_AT(stack_top) = child.y;
  stack_top += uint(met > 1u);
  COUNT_STACK(stack_top)
#else
  if (met > 3u) STACK_AT(stack_top++) = child.w;
  if (met > 2u) STACK_AT(stack_top++) = child.z;
  if (met > 1u) STACK_AT(stack_top++) = child.y;
  COUNT_STACK(stack_top)
  uint popped = STACK_AT(stack_top - 1u);
#endif
  stack_top = max(stack_top - uint(met == 0u), 1u);
  node = met == 0u ? popped : child.x;
}

#ifndef TRIANGLE_SETTLES
TriangleTexels fetch_from(Walker w, uint block, uint i) {
  return fetch_triangle(block + LEAF_HEADER_TEXELS + i * TRIANGLE_TEXELS, texel_order(w.space));
}

// Replaces `best` by the hit of a triangle if that is nearer.
void take_nearer(Walker w, TriangleTexels triangle, uint place, inout Hit best) {
  float t, u, v;
  bool hit = hit_triangle(w.ray, w.space, triangle, t, u, v) && may_count(w.space, t, w.ray, w.hit) &&
             nearer(w.space, t, place, best);
  best = Hit(hit ? t : best.t, hit ? place : best.prim, hit ? u : best.u, hit ? v : best.v);
}

// Tests two triangles of a leaf. Returns true at the end of the leaf. Both are read before either is tested: with
// consider() for one after the other it is 0.95 to 0.97 times as fast (lavapipe 22.3.6, ambient occlusion and diffuse
// rays of sponza and conference).
bool meet_triangles(inout Walker w, uint block, uint last) {
  COUNT_LEAF(tested == 0u, last + 1u)
  COUNT_TRIANGLES(min(last - tested, 1u) + 1u)
  Hit best = w.hit;
#if BALLOT_LEAF_LOOP
  uint other = min(tested + 1u, last);
  TriangleTexels a = fetch_from(w, block, tested), b = fetch_from(w, block, other);
  take_nearer(w, a, triangle_place(a, block, tested), best);
  take_nearer(w, b, triangle_place(b, block, other), best);
#else
  TriangleTexels only = fetch_from(w, block, 0u);
  take_nearer(w, only, triangle_place(only, block, 0u), best);
#endif
  w.hit = best;
  tested += 2u;
  return tested > last;
}
#endif

// Tests triangles of a leaf, all of them in a mode that settles leaves as a whole. Pops the stack at the end of the
// leaf. Lanes without one go along.
void step_leaf(inout Walker w, inout uint node) {
  bool done = false;
  if (is_at_leaf(node)) {
#if defined(TRIANGLE_SETTLES) || BALLOT_LEAF_BOX || BALLOT_SHAPES
    visit_leaf(w, node, true);
    done = true;
#else
    done = meet_triangles(w, node & LEAF_TEXEL_MASK, node >> LEAF_COUNT_SHIFT & 7u);
#endif
  }
  if (done) tested = 0u;
  uint popped = STACK_AT(stack_top - 1u);
  stack_top = max(stack_top - uint(done), 1u);
  if (done) node = popped;
#if BALLOT_ANY_HIT
  if (w.hit.prim != NO_HIT) node = END_OF_TREE;
#endif
}

uint traverse(inout Walker w, bool live, uint node) {
  if (!live) node = END_OF_TREE;
  uint least = refill_left ? max(push.threshold, 1u) : 1u, working;
  do {
    uint going;
    do {
      step_down(w, node);
      going = count_lanes(is_inner(node));
    } while (going > FEW);
    do {
      step_leaf(w, node);
      going = count_lanes(is_at_leaf(node));
    } while (going > FEW);
    working = count_lanes(node != END_OF_TREE);
  } while (working >= least);
  return node;
}

#include "../lib/frame/main.glsl"
