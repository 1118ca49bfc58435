// The walk for the closest point, a piece of the body of a function. It takes `record`, a point and its limit, and
// `inside`, which is false for a lane without a point. It leaves what store_nearest() writes: the probe `p`, the answer
// `best` and the `limit`.
  float limit = record.w;
  bool live = inside && is_finite(record.xyz) && is_limit(limit);
  Probe p = make_probe(live ? record.xyz : push.scene_lo);
  PROBE_STACK_DECLARE
  uint top = 0u, node = live ? push.root : END_OF_TREE;
  stack[top] = END_OF_TREE;
  stack_near[top++] = -1.0;
  float limit2 = limit_distance2(p, limit);
  Best best = Best(limit2, limit2, NO_HIT, 0u);
#if BALLOT_BLOCKS && !BALLOT_INSTANCES
#include "closest_block.glsl"
#endif
#if BALLOT_INSTANCES
  begin_instances(live);
#if BALLOT_FILTERS >> FILTER_GROUP
  begin_group(live, group_root(question_group), shared_root());
#endif
  for (node = next_instance(p, best.reach2); node != END_OF_TREE; top = 1u, node = next_instance(p, best.reach2))
#endif
  while (node != END_OF_TREE) {
    while (is_inner(node)) {
      Pair pair = fetch_pair(node);
      float l = box_distance2(p, pair.l), r = box_distance2(p, pair.r);
      bool right_first = r < l;
      uint first = right_first ? pair.right : pair.left, other = right_first ? pair.left : pair.right;
      float near = smaller(l, r), next = larger(l, r);
      bool any = near <= best.reach2, both = next <= best.reach2;
      stack[top] = other;
      stack_near[top] = next;
      top += uint(both);
      node = first;
      if (!any) {
        do {
          --top;
        } while (stack_near[top] > best.reach2);
        node = stack[top];
      }
    }
    if (CAME_TO_LEAF(node)) {
      uint block = node & LEAF_TEXEL_MASK, count = (node >> LEAF_COUNT_SHIFT & 7u) + 1u, i = 0u;
      do {
        consider_nearest(p, best, block + LEAF_HEADER_TEXELS + i * TRIANGLE_TEXELS);
        ++i;
      } while (i < count);
      do {
        --top;
      } while (stack_near[top] > best.reach2);
      node = stack[top];
    }
  }
