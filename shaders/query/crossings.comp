#version 460
#extension GL_GOOGLE_include_directive : require
// Crossings: for each ray, how many triangles it crosses with t in [t_min, t_max], and which. A walk of the pair tree,
// one ray a lane, in no order; with BALLOT_FIRST nearer children first.
//
// Result: the number of crossings, a word a ray; UNFINISHED if the driver cut the walk short. With BALLOT_LISTS also
// the crossings, in no order, from slot places[i] on and before slot places[i + 1]; what does not fit there is left
// out. With BALLOT_FIRST the list has the first crossings, and may have others (lib/query/first.glsl); their number is
// then that of the list.
//
// lib/query/triangle_crossing.glsl has what a crossing is, and why closed surfaces are crossed an even number of times.
// The tree must hold each triangle in one leaf.
//
// With BALLOT_WIDE it walks the four-wide tree instead, which reads four boxes with the bytes of two: about 1.1 times
// as fast on lavapipe 22.3.6 (bunny, rays of a camera and random ones). Leaves are put aside and tested together, so
// that lanes do not wait for each other at every leaf.
//
// BALLOT_EXACT: a ray is UNSURE if rounding may have decided; the host finds its crossings exactly.
#if BALLOT_WIDE
#define METHOD_WITHOUT_PAIRS
#endif
#include "../lib/frame/kernel.glsl"
#include "../shared/query.h"
#include "../lib/query/triangle_crossing.glsl"
#if BALLOT_FIRST
#include "../lib/query/first.glsl"
#endif
#if BALLOT_WIDE
#include "../lib/tree/bvh4.glsl"
#endif

layout(set = 0, binding = BIND_CROSSINGS, scalar) writeonly buffer Answers { uint answers[]; };
#if BALLOT_LISTS
layout(set = 0, binding = BIND_PLACES, scalar) readonly buffer Places { uint places[]; };
#endif

// Room for leaves that are put aside; they are tested once another step could overflow it. More room lets more lanes
// test leaves at the same time. A ray that is after its first crossing alone had better have it soon.
#if BALLOT_WIDE
#define CHILDREN 4u
#else
#define CHILDREN 2u
#endif
#if BALLOT_FIRST
const uint LEAF_ROOM = FIRST == 1u ? CHILDREN : 12u;
#else
const uint LEAF_ROOM = 12u;
#endif
const uint SLOTS = STACK_SIZE + LEAF_ROOM;

// Puts a child that is met aside if it is a leaf, and on the stack if not. Leaves lie at the other end of the stack.
#define TAKE_CHILD(child, is_met)                              \
  {                                                            \
    bool met = is_met, leaf = !is_inner(child);                \
    stack[leaf ? SLOTS - 1u - leaves : top] = child;           \
    top += uint(met && !leaf);                                 \
    leaves += uint(met && leaf);                               \
  }

void main() {
  uint index = push.ray_begin + gl_GlobalInvocationID.x;
  bool inside = index < push.ray_end;
  Ray given = load_ray(inside ? index : push.ray_begin);
  bool live = inside && !is_dead(given);
  if (!live) given = Ray(vec3(0.0), 0.0, vec3(0.0, 0.0, 1.0), 0.0);
  Walker w = make_walker(given);
  Units units = units_of(given);
  uint stack[SLOTS];
  uint top = 0u, leaves = 0u, node = END_OF_TREE, found = 0u;
  stack[top++] = END_OF_TREE;
  if (live && push.root != END_OF_TREE) TAKE_CHILD(push.root, true)
  node = stack[--top];
#if BALLOT_LISTS
  uint slot = places[inside ? index : push.ray_begin], end = places[(inside ? index : push.ray_begin) + 1u];
#endif
  begin_crossings(inside ? index : push.ray_begin);
#if BALLOT_FIRST
  begin_first(w.ray.t_max);
#endif
  bool truncated = false, unsure = false;
  do {
    while (is_inner(node) && leaves + CHILDREN <= LEAF_ROOM) {
#if BALLOT_WIDE && BALLOT_FIRST
      uvec4 child;
      uint met = met_children(w, node, child);
      TAKE_CHILD(child.w, met > 3u)
      TAKE_CHILD(child.z, met > 2u)
      TAKE_CHILD(child.y, met > 1u)
      TAKE_CHILD(child.x, met > 0u)
#elif BALLOT_WIDE
      Bvh4Node q = fetch_bvh4(node);
      Bvh4Planes p = planes_of(w, q);
      float far = reach(w.space, w.hit);
      TAKE_CHILD(q.child.x, entry_of(p, 0u, w.ray.t_min, far) != NOT_MET)
      TAKE_CHILD(q.child.y, entry_of(p, 1u, w.ray.t_min, far) != NOT_MET)
      TAKE_CHILD(q.child.z, q.child.z != END_OF_TREE && entry_of(p, 2u, w.ray.t_min, far) != NOT_MET)
      TAKE_CHILD(q.child.w, q.child.w != END_OF_TREE && entry_of(p, 3u, w.ray.t_min, far) != NOT_MET)
#else
      Pair pair = fetch_pair(node);
      float entry_l, entry_r;
      bool l = meets(w, pair.l, entry_l), r = meets(w, pair.r, entry_r);
#if BALLOT_FIRST
      bool swap = l && r && entry_l < entry_r;  // the nearer one is taken from the stack first
      TAKE_CHILD(swap ? pair.right : pair.left, swap ? r : l)
      TAKE_CHILD(swap ? pair.left : pair.right, swap ? l : r)
#else
      TAKE_CHILD(pair.left, l)
      TAKE_CHILD(pair.right, r)
#endif
#endif
      node = stack[--top];
    }
    if (CUT_SHORT(is_inner(node) && leaves + CHILDREN <= LEAF_ROOM)) break;
    uint left = 0u, texel = 0u;  // triangles of the leaf that are still to be tested, and the next one
    while (leaves + left != 0u) {
      if (left == 0u) {
        uint leaf = stack[SLOTS - leaves--];
        texel = (leaf & LEAF_TEXEL_MASK) + LEAF_HEADER_TEXELS;
        left = (leaf >> LEAF_COUNT_SHIFT & 7u) + 1u;
      }
      Hit hit;
      Doubt doubt;
      bool crossed = crosses(w, texel, hit, doubt);
#if BALLOT_FIRST
      crossed = crossed && doubt.low <= w.hit.t;
      if (crossed) take_first(doubt.high);
      if (doubt.open) open_t = smaller(open_t, doubt.low);
      w.hit.t = first_t[FIRST - 1u];
#else
      unsure = unsure || doubt.open;
#endif
      found += uint(crossed);
#if BALLOT_LISTS
      if (crossed && slot < end) {
        store_hit(slot, Hit(hit.t * units.scale, hit.prim, hit.u, hit.v));
        ++slot;
      }
#endif
      texel += TRIANGLE_TEXELS;
      --left;
    }
    truncated = truncated || CUT_SHORT(leaves + left != 0u);
  } while (node != END_OF_TREE && !truncated);
#if BALLOT_FIRST
  unsure = open_t <= w.hit.t;
#endif
  if (inside) {
    bool cut_short = WALK_CUT_SHORT(live && (node != END_OF_TREE || truncated));
    answers[index] = cut_short ? UNFINISHED : unsure ? UNSURE : found;
    if (cut_short) atomicAdd(work.unfinished, 1u);
  }
}
