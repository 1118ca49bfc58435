#version 460
#extension GL_GOOGLE_include_directive : require
// "frontier" traversal: a packet at the top of the tree, then every ray by itself. The frontier is the line where the
// top of the tree ends; it is found once for each tree. Each lane tests one frontier node against bounds of all rays of
// the subgroup, and a ballot tells which nodes the rays may enter. Of these, each ray then walks the subtrees of the
// nodes that it meets, front to back.
//
// Based on:
//   Alexander Reshetov, Alexei Soupikov, Jim Hurley. Multi-Level Ray Tracing Algorithm. SIGGRAPH 2005 (entry points).
//   Kirill Garanzha, Charles Loop. Fast Ray Sorting and Breadth-First Packet Traversal for GPU Ray Tracing.
//   Eurographics 2010 (a frustum finds where its rays enter the tree).
//   Marek Vinkler. Traversal methods for GPU ray tracing. Section 3.3 (a packet first, then rays by themselves).
// Differs: the top is not walked but tested at once, so the packet takes one step (two with 32 lanes) whatever the
// rays.
//
// traverse(walker, live, node)
//   live   false if the lane has no ray
//   Flow   subgroup-uniform until the entries are known, then lanes diverge
//   Memory STACK_SIZE words per lane
//   push.threshold   rays start at the root if there are more entries than this
#define METHOD_REDUCES
#include "../lib/frame/kernel.glsl"
#include "../lib/tree/walk.glsl"
#include "../lib/frame/lanes.glsl"
#include "../lib/tree/frontier.glsl"

// Returns the nodes at which the lane's ray may enter the tree. Without any, the ray starts at the given node.
Entries find_entries(inout Walker w, bool live, inout uint node) {
  Entries none = Entries(0u, uvec2(0u));
  Beam beam;
  // The frontier belongs to the whole tree, whose root is texel 0.
  if (node != 0u || !make_beam(w, live, beam)) return none;
  Entries e = entries_of(beam, live);
  if (bitCount(e.left.x) + bitCount(e.left.y) > push.threshold) return none;
  COUNT_SWITCH(1u, 0u)
  node = END_OF_TREE;
  return live ? e : none;
}

void traverse(inout Walker w, bool live, uint node) {
  STACK_DECLARE
  uint top = 1u;
  STACK_AT(0) = END_OF_TREE;
  Entries entries = find_entries(w, live, node);
  if (!live) node = END_OF_TREE;
  while (node != END_OF_TREE || has_entries(entries)) {
    while (node == END_OF_TREE && has_entries(entries)) {
      FrontierNode next = fetch_frontier(take_entry(entries));
      float entry;
      if (meets_bounds(w, next.lo, next.hi, entry)) node = next.child;
      top = 1u;
    }
    while (is_inner(node)) WALK_STEP(w, node, top)
    WALK_LEAVES(w, node, top)
#if BALLOT_ANY_HIT
    if (w.hit.prim != NO_HIT) entries.left = uvec2(0u);
#endif
  }
}

#include "../lib/frame/main.glsl"
