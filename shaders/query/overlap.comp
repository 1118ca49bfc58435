#version 460
#extension GL_GOOGLE_include_directive : require
// Overlap: for each box, the triangles that have a point in common with it. A walk of the pair tree, one box a lane, in
// no order. The tree must hold each triangle in one leaf.
//
// Result: their number, a word a box; UNSURE if rounding may have decided about one; UNFINISHED if the walk did not
// finish. With BALLOT_LISTS also the list, in no order (lib/query/listing.glsl): (0, prim).
//
// The walk is that of a point, the box's middle c, as shaders/query/within.comp has it, but for the boxes of nodes: a
// lane visits those that are no farther from c along each axis than the box reaches. How far that is, e, is widened by
// 2^-20 of itself, and by what rounds to zero. A triangle that overlaps the box has a point p with |p - c| <= e along
// each axis, and the boxes of its nodes are no farther from c than p is, by the proof there. Among instances e is
// turned as their nodes are, to |Q| e, and instances are visited that are no farther from c than the box's corners.
#include "../lib/frame/kernel.glsl"
#include "../shared/query.h"
#include "../lib/query/near.glsl"
#include "../lib/query/overlap.glsl"
#define RECORD uvec2
#include "../lib/query/listing.glsl"

layout(set = 0, binding = BIND_CROSSINGS, scalar) writeonly buffer Answers { uint answers[]; };

#if BALLOT_FILTERS
#include "../lib/query/filters.glsl"
#endif

const float WIDER = 1.0000010, ROUNDS_TO_ZERO = 2.3509887e-38;  // 1 + 2^-20, 2^-125

uint found = 0u;
bool unsure = false;

void take_overlap(Solid box, uint texel) {
#if BALLOT_FILTERS
  if (is_left_out(PRIM_OF(texel))) return;
#endif
  uint state = overlap_of(box, CORNERS_OF(fetch_triangle(texel, AS_STORED)));
  if (state == APART) return;
  ++found;
  unsure = unsure || state == OPEN;
#if BALLOT_LISTS != LISTS_NONE
  list(uvec2(0u, PRIM_OF(texel)));
#endif
}

// Returns how far a box reaches along the axes along which outside_of() tells distances.
vec3 turned(vec3 reach) {
#if BALLOT_INSTANCES
  uint at = POINT_HEADER_TEXELS + instance * POINT_TEXELS + 3u;
  vec3 x = abs(point_texel(at).xyz), y = abs(point_texel(at + 1u).xyz), z = abs(point_texel(at + 2u).xyz);
  return WIDER * vec3(x.x * reach.x + x.y * reach.y + x.z * reach.z, y.x * reach.x + y.y * reach.y + y.z * reach.z,
                      z.x * reach.x + z.y * reach.y + z.z * reach.z);
#else
  return reach;
#endif
}

void main() {
#if BALLOT_INSTANCES
  begin_scene();
#endif
  uint index = push.ray_begin + gl_GlobalInvocationID.x;
  bool inside = index < push.ray_end;
  uint mine = inside ? index : push.ray_begin;
  bool wanted = begin_list(mine) && inside;
  vec3 lo = ray_half(2u * mine).xyz, hi = ray_half(2u * mine + 1u).xyz;
#if BALLOT_FILTERS
  begin_filters(mine);
#endif
  bool live = wanted && is_finite(lo) && is_finite(hi) && all(lessThanEqual(order_of(lo), order_of(hi)));
  if (!live) lo = hi = push.scene_lo;
  Solid box = solid_of(lo, hi);
  precise vec3 middle = 0.5 * lo + 0.5 * hi;
  vec3 reach = WIDER * larger(hi - middle, middle - lo) + ROUNDS_TO_ZERO;
  Probe p = make_probe(middle);
  p.pad = POINT_PAD * scene_reach(p.at);
  uint stack[STACK_SIZE];
  uint top = 0u, node = live ? push.root : END_OF_TREE;
  stack[top++] = END_OF_TREE;
#if BALLOT_INSTANCES
  float limit2 = limit_distance2(p, 1.7320519 * larger(reach.x, larger(reach.y, reach.z)));
  begin_instances(live);
#if BALLOT_FILTERS >> FILTER_GROUP
  begin_group(live, group_root(question_group), shared_root());
#endif
  for (node = next_instance(p, limit2); node != END_OF_TREE; top = 1u, node = next_instance(p, limit2))
#endif
  {
    vec3 most = turned(reach);
    while (node != END_OF_TREE) {
      while (is_inner(node)) {
        Pair pair = fetch_pair(node);
        bool l = all(lessThanEqual(OUTSIDE_OF(p, pair.l), most)), r = all(lessThanEqual(OUTSIDE_OF(p, pair.r), most));
        stack[top] = pair.right;
        top += uint(l && r);
        node = l ? pair.left : pair.right;
        if (!l && !r) node = stack[--top];
      }
      if (CAME_TO_LEAF(node)) {
        uint block = node & LEAF_TEXEL_MASK, count = (node >> LEAF_COUNT_SHIFT & 7u) + 1u, i = 0u;
        do {
          take_overlap(box, block + LEAF_HEADER_TEXELS + i * TRIANGLE_TEXELS);
          ++i;
        } while (i < count);
        node = stack[--top];
      }
    }
  }
  bool finished = finish_walks(1u);
  if (inside && WRITES_NUMBER) answers[index] = !finished ? UNFINISHED : unsure ? UNSURE : found;
}
