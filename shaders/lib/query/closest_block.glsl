// The beginning of the walk for the closest points of a block, the points of a subgroup that are near each other: a
// piece of closest_walk.glsl. The lanes vote at each node and go on together: into a child, or to a leaf, that one of
// them has to visit, first to the one that is nearer for most. So they read the same texels, and none waits for a
// longer walk of another. Where few lanes have to visit what the block does, each goes on alone, from the same stack.
//
//   Flow   subgroup-uniform
#define POP_BLOCK                                                            \
  do {                                                                       \
    --top;                                                                   \
  } while (top > 0u && !subgroupAny(stack_near[top] <= best.reach2));        \
  node = stack[top];
  const int TOGETHER = int(SUBGROUP_SIZE) / 3;  // lanes that a visit serves, if the walk is to stay together
  int credit = 16 * TOGETHER;
  if (!live) best.distance2 = best.reach2 = -1.0;
  node = subgroupAny(live) ? push.root : END_OF_TREE;
  while (node != END_OF_TREE && credit > 0) {
    while (is_inner(node) && credit > 0) {
      Pair pair = fetch_pair(node);
      float l = box_distance2(p, pair.l), r = box_distance2(p, pair.r);
      bool to_l = l <= best.reach2, to_r = r <= best.reach2;
      uvec4 lefts = subgroupBallot(to_l), rights = subgroupBallot(to_r);
      uint first_l = subgroupBallotBitCount(subgroupBallot(to_l && l <= r));
      uint first_r = subgroupBallotBitCount(subgroupBallot(to_r && r < l));
      bool any_l = lefts != uvec4(0u), any_r = rights != uvec4(0u);
      credit = min(credit + int(first_l + first_r) - TOGETHER, 16 * TOGETHER);
      if (any_l && any_r) {
        bool right_first = first_r > first_l;
        stack[top] = right_first ? pair.left : pair.right;
        stack_near[top++] = right_first ? l : r;
        node = right_first ? pair.right : pair.left;
      } else if (any_l || any_r) {
        node = any_l ? pair.left : pair.right;
      } else {
        POP_BLOCK
      }
    }
    if (node != END_OF_TREE && !is_inner(node)) {
      uint block = node & LEAF_TEXEL_MASK, count = (node >> LEAF_COUNT_SHIFT & 7u) + 1u, i = 0u;
      do {
        consider_nearest(p, best, block + LEAF_HEADER_TEXELS + i * TRIANGLE_TEXELS);
        ++i;
      } while (i < count);
      POP_BLOCK
    }
  }
  if (!live) node = END_OF_TREE;
