#version 460
#extension GL_GOOGLE_include_directive : require
// "speculative" traversal: while-while traversal in which a lane that finds a leaf postpones it and walks on. When
// every lane of the subgroup that is at work has found a leaf, all lanes test triangles together.
//
// Based on:
//   Timo Aila, Samuli Laine. Understanding the Efficiency of Ray Traversal on GPUs. HPG 2009. ("speculative traversal")
//
// traverse(walker, live, node)
//   live   false if the lane has no ray
//   Flow   lanes diverge; the vote sees the lanes that are in the same loop, and any result of it is correct
//   Memory STACK_SIZE words per lane
#include "../lib/frame/kernel.glsl"
#include "../lib/tree/walk.glsl"

void traverse(inout Walker w, bool live, uint node) {
  STACK_DECLARE
  uint top = 0u;
  STACK_AT(top++) = END_OF_TREE;
  if (!live) node = END_OF_TREE;
  uint leaf = END_OF_TREE;  // the postponed leaf
  while (node != END_OF_TREE || leaf != END_OF_TREE) {
    while (is_inner(node)) {
      WALK_STEP(w, node, top)
      if (!is_inner(node) && node != END_OF_TREE && leaf == END_OF_TREE) {
        leaf = node;
        node = STACK_AT(--top);
      }
      if (!subgroupAny(leaf == END_OF_TREE)) break;
    }
    if (leaf == END_OF_TREE && !is_inner(node)) {  // the root is a leaf
      leaf = node;
      node = END_OF_TREE;
    }
    while (leaf != END_OF_TREE) {
      visit_leaf(w, leaf, true);
      leaf = END_OF_TREE;
      if (!is_inner(node) && node != END_OF_TREE) {
        leaf = node;
        node = STACK_AT(--top);
      }
    }
#if BALLOT_ANY_HIT
    if (w.hit.prim != NO_HIT) node = END_OF_TREE;
#endif
  }
}

#include "../lib/frame/main.glsl"
