#version 460
#extension GL_GOOGLE_include_directive : require
// Within: for each point, the triangles whose distance is at most its limit. A walk of the pair tree, one point a lane,
// in no order. The tree must hold each triangle in one leaf.
//
// Result: their number, a word a point; UNFINISHED if the walk did not finish. With BALLOT_LISTS also the list, in no
// order (lib/query/listing.glsl): (distance, prim).
//
// A distance has the bits that shaders/query/closest_point.comp computes for the triangle. It depends on point and
// triangle alone, and no box culls a triangle whose distance is within the limit: the proof there holds for the limit
// in the place of the best distance so far. Points that are `far` have padding here, as a list must not depend on the
// tree. So the list depends neither on the tree nor on the order of the walk.
#include "../lib/frame/kernel.glsl"
#include "../shared/query.h"
#include "../lib/query/near.glsl"
#define RECORD uvec2
#include "../lib/query/listing.glsl"

layout(set = 0, binding = BIND_CROSSINGS, scalar) writeonly buffer Answers { uint answers[]; };

#if BALLOT_FILTERS
#include "../lib/query/filters.glsl"
#endif

uint found = 0u;

void take_within(Probe p, float limit, uint texel) {
#if BALLOT_FILTERS
  if (is_left_out(PRIM_OF(texel))) return;
#endif
  float inverse = 1.0 / p.scale;
  precise float root = sqrt(DISTANCE2_OF(p, texel));
  float distance = root * inverse;
  if (distance <= limit) {
    ++found;
#if BALLOT_LISTS != LISTS_NONE
    list(uvec2(floatBitsToUint(distance), PRIM_OF(texel)));
#endif
  }
}

void main() {
#if BALLOT_INSTANCES
  begin_scene();
#endif
  uint index = push.ray_begin + gl_GlobalInvocationID.x;
  bool inside = index < push.ray_end;
  uint mine = inside ? index : push.ray_begin;
  bool wanted = begin_list(mine) && inside;
  vec4 record = ray_half(mine);
#if BALLOT_FILTERS
  begin_filters(mine);
#endif
  float limit = record.w;
  bool live = wanted && is_finite(record.xyz) && is_limit(limit);
  Probe p = make_probe(live ? record.xyz : push.scene_lo);
  p.pad = POINT_PAD * scene_reach(p.at);
  uint stack[STACK_SIZE];
  uint top = 0u, node = live ? push.root : END_OF_TREE;
  stack[top++] = END_OF_TREE;
  float limit2 = limit_distance2(p, limit);
#if BALLOT_INSTANCES
  begin_instances(live);
#if BALLOT_FILTERS >> FILTER_GROUP
  begin_group(live, group_root(question_group), shared_root());
#endif
  for (node = next_instance(p, limit2); node != END_OF_TREE; top = 1u, node = next_instance(p, limit2))
#endif
  while (node != END_OF_TREE) {
    while (is_inner(node)) {
      Pair pair = fetch_pair(node);
      bool l = box_distance2(p, pair.l) <= limit2, r = box_distance2(p, pair.r) <= limit2;
      stack[top] = pair.right;
      top += uint(l && r);
      node = l ? pair.left : pair.right;
      if (!l && !r) node = stack[--top];
    }
    if (CAME_TO_LEAF(node)) {
      uint block = node & LEAF_TEXEL_MASK, count = (node >> LEAF_COUNT_SHIFT & 7u) + 1u, i = 0u;
      do {
        take_within(p, limit, block + LEAF_HEADER_TEXELS + i * TRIANGLE_TEXELS);
        ++i;
      } while (i < count);
      node = stack[--top];
    }
  }
  bool finished = finish_walks(1u);
  if (inside && WRITES_NUMBER) answers[index] = finished ? found : UNFINISHED;
}
