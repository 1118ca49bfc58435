// The walk of the inside test, as a part of a function that has the variables
//   p, node, stack, top   the probe, where the walk begins, its stack with the sentinel
//   crossings             counts triangles that the ray crosses
  while (node != END_OF_TREE) {
    while (is_inner(node)) {
      Pair pair = fetch_pair(node);
      bool l = may_meet(p, pair.l), r = may_meet(p, pair.r);
      uint popped = stack[top - 1u];
      stack[top] = pair.right;
      top += uint(l && r);
      top -= uint(!(l || r));
      node = l ? pair.left : r ? pair.right : popped;
    }
    if (CAME_TO_LEAF(node)) {
      uint block = node & LEAF_TEXEL_MASK, count = (node >> LEAF_COUNT_SHIFT & 7u) + 1u, i = 0u;
      do {
        crossings += uint(crosses(p, block + LEAF_HEADER_TEXELS + i * TRIANGLE_TEXELS));
        ++i;
      } while (i < count);
      node = stack[--top];
    }
  }
