// The leaves that a ray meets, by a walk of the compressed eight-wide tree; with BALLOT_FIRST its nodes come in the
// order of the ray's octant. The functions are those of walk_pairs.glsl; the walk begins at the root of the tree.
//
// It is for devices that mask lanes by instructions, such as lavapipe. All lanes take every step, as a step that is
// masked costs as much. What lanes without a node write is beyond the top of their stacks. Loops end behind their body:
// lavapipe 22.3 runs the body of a loop that ends before it once more.
#include "../tree/bvh8.glsl"

// Room for groups of leaves, and for leaves. A ray that is after its first crossings had better have them soon, so that
// their reach culls the rest (tools/measured/queries.md).
#if BALLOT_FIRST
const uint GROUP_ROOM = FIRST == 1u ? 1u : 4u;
#else
const uint GROUP_ROOM = 15u;
#endif
const uint LEAF_ROOM = 12u, GROUPS = STACK_SIZE / 2u;

// Inner nodes of one parent each, and leaves of one parent each (Bvh8Group). The bottom of both is a group without
// children.
uint inner_all[GROUPS + 1u], inner_hits[GROUPS + 1u];
uint leaves_all[GROUP_ROOM + 2u], leaves_hits[GROUP_ROOM + 2u];
uint inner_top, groups_top;
Bvh8Group nodes_left;
uint found_leaves[LEAF_ROOM + 1u], leaf_count;

void begin_walk(bool live) {
  inner_all[0] = inner_hits[0] = leaves_all[0] = leaves_hits[0] = 0u;
  inner_top = groups_top = 1u;
  nodes_left = Bvh8Group(0u, live && push.root != END_OF_TREE ? 1u : 0u);
  leaf_count = 0u;
}

bool may_step() { return nodes_left.hits != 0u && groups_top <= GROUP_ROOM; }

// Takes a step to a node that is left, and puts its siblings and leaves aside. Pops the stack if the ray meets none of
// its nodes.
void step_down(Walker w, uint octant) {
  bool steps = may_step();
  uint node = steps ? take_node(nodes_left, octant) : 0u;
  inner_all[inner_top] = nodes_left.all;
  inner_hits[inner_top] = nodes_left.hits;
  inner_top += uint(steps && nodes_left.hits != 0u);
  Bvh8Group inner, leaf;
  meet_children(w, node, octant, inner, leaf);
  leaves_all[groups_top] = leaf.all;
  leaves_hits[groups_top] = leaf.hits;
  groups_top += uint(steps && leaf.hits != 0u);
  bool none = inner.hits == 0u;
  uint below = inner_top - uint(inner_top > 1u);
  Bvh8Group popped = Bvh8Group(inner_all[below], inner_hits[below]);
  inner_top -= uint(steps && none && inner_top > 1u);
  if (none) inner = popped;
  if (steps) nodes_left = inner;
}

bool may_unfold() { return groups_top > 1u && leaf_count < LEAF_ROOM; }

// Puts one leaf of the last group aside.
void unfold() {
  uint last = groups_top - 1u;
  bool takes = may_unfold();
  Bvh8Group group = takes ? Bvh8Group(leaves_all[last], leaves_hits[last]) : Bvh8Group(0u, 1u);
  found_leaves[leaf_count] = take_leaf(group);
  leaf_count += uint(takes);
  if (takes) leaves_hits[last] = group.hits;
  groups_top -= uint(takes && group.hits == 0u);
}

void find_leaves(Walker w) {
#if BALLOT_FIRST
  uint octant = octant_of(w);
#else
  const uint octant = 0u;
#endif
  do step_down(w, octant);
  while (may_step());
  do unfold();
  while (may_unfold());
}

uint next_leaf() { return found_leaves[--leaf_count]; }

bool is_walking() { return nodes_left.hits != 0u || groups_top > 1u; }

void end_walk() {
  nodes_left.hits = leaf_count = 0u;
  groups_top = 1u;
}
