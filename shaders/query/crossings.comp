#version 460
#extension GL_GOOGLE_include_directive : require
// Crossings: for each ray, how many triangles it crosses with t in [t_min, t_max], and which. A walk of the pair tree,
// one ray a lane, in no order.
//
// Sources: those of lib/numeric/triangle_watertight.glsl, by whose arithmetic vertices are sheared and t is found, and
// of shaders/query/inside.comp, by whose rule ties are broken.
//
// Result: the number of crossings, a word a ray; UNFINISHED if the driver cut the walk short. With BALLOT_LISTS also
// the crossings, in no order, from slot places[i] on and before slot places[i + 1]; what does not fit there is left
// out.
//
// Why a closed surface is crossed an even number of times by a line, and once at an edge or vertex where it is passed
// through: a vertex is sheared by the same operations in every triangle that holds it, so the triangles are those of
// one moved mesh, and the proof of inside.comp holds for its projection. A ray exactly through an edge or a vertex is
// moved by an infinitesimal step across its main axis, the same for all triangles. At a silhouette it then passes
// beside the surface or crosses both sides.
//
// t is that of the watertight test, with its bound: 15 * 2^-24 of the distance along the main axis. Boxes are culled as
// for that test. The tree must hold each triangle in one leaf.
//
// With BALLOT_WIDE it walks the four-wide tree instead, which reads four boxes with the bytes of two: about 1.1 times
// as fast on lavapipe 22.3.6 (bunny, rays of a camera and random ones). Leaves are put aside and tested together, so
// that lanes do not wait for each other at every leaf.
//
// What is asked for alone is compiled. BALLOT_CULL leaves out triangles that are seen from their back or front.
// BALLOT_MASKS leaves out those whose mask shares no bit with the ray's. BALLOT_EXACT: a ray is UNSURE if rounding may
// have decided; the host finds its crossings exactly. The bounds are in lib/query/sure.glsl.
#if BALLOT_WIDE
#define METHOD_WITHOUT_PAIRS
#endif
#include "../lib/frame/kernel.glsl"
#include "../shared/query.h"
#include "../lib/query/crossing.glsl"
#if BALLOT_EXACT
#include "../lib/query/sure.glsl"
#endif
#if BALLOT_WIDE
#include "../lib/tree/bvh4.glsl"
#endif

layout(set = 0, binding = BIND_CROSSINGS, scalar) writeonly buffer Answers { uint answers[]; };
#if BALLOT_LISTS
layout(set = 0, binding = BIND_PLACES, scalar) readonly buffer Places { uint places[]; };
#endif
#if BALLOT_MASKS
layout(set = 0, binding = BIND_RAY_MASKS, scalar) readonly buffer RayMasks { uint ray_masks[]; };
layout(set = 0, binding = BIND_TRIANGLE_MASKS, scalar) readonly buffer TriangleMasks { uint triangle_masks[]; };
uint ray_mask;
#endif
#if BALLOT_EXACT
bool unsure = false;
#endif

// Returns true if the ray crosses the triangle in range; then `hit` is the crossing, in units of the scaled ray.
bool crosses(Walker w, uint texel, out Hit hit) {
  TriangleTexels triangle = fetch_triangle(texel, texel_order(w.space));
  RaySpace s = w.space;
  vec3 p = uintBitsToFloat(triangle.a.xyz), q = uintBitsToFloat(triangle.b.xyz);
  precise vec3 z = uintBitsToFloat(triangle.c.xyz) - s.origin.z;
  vec3 x = multiply_add(vec3(s.first), z, multiply_add(p, vec3(s.scale), vec3(-s.origin.x)));
  vec3 y = multiply_add(vec3(s.second), z, multiply_add(q, vec3(s.scale), vec3(-s.origin.y)));
  vec2 a = vec2(x.x, y.x), b = vec2(x.y, y.y), c = vec2(x.z, y.z);
  float e0 = side_value(b, c), e1 = side_value(c, a), e2 = side_value(a, b);
  precise float det = e0 + e1 + e2;
  precise float inv = 1.0 / det;
  precise vec3 weights = vec3(e0, e1, e2) * inv;
  precise float t = multiply_add(weights.z, z.z, multiply_add(weights.y, z.y, weights.x * z.x)) * s.inv;
  hit = Hit(t, triangle.a.w, weights.y, weights.z);
#if BALLOT_EXACT
  float room = sides_room(x, y, z, s.scale);
  float least = smaller(smaller(e0, e1), e2), most = larger(larger(e0, e1), e2);
  bool crossed = least > room || most < -room, open = !crossed && !(least < -room && most > room);
  float off = depth_room(z, det, room) * abs(s.inv);
  bool in_range = t - off > w.ray.t_min && t + off < w.ray.t_max;
  bool out_of_range = t + off < w.ray.t_min || t - off > w.ray.t_max;
  bool front = (e0 > 0.0) == (s.inv > 0.0);
  open = open || (crossed && !in_range && !out_of_range);
  crossed = crossed && in_range;
#else
  int s0 = side_sign(e0, b, c), s1 = side_sign(e1, c, a), s2 = side_sign(e2, a, b);
  bool crossed = s0 != 0 && s0 == s1 && s1 == s2 && t >= w.ray.t_min && t <= w.ray.t_max;
  bool front = (s0 > 0) == (s.inv > 0.0);
#endif
#if BALLOT_CULL == CULL_BACK
  crossed = crossed && front;
#elif BALLOT_CULL == CULL_FRONT
  crossed = crossed && !front;
#endif
#if BALLOT_MASKS
  if (crossed) crossed = (triangle_masks[hit.prim] & ray_mask) != 0u;
#endif
#if BALLOT_EXACT
  unsure = unsure || open;
#endif
  return crossed;
}

// Puts a child that is met aside if it is a leaf, and on the stack if not. Leaves lie at the other end of the stack.
#if BALLOT_WIDE
const uint LEAF_ROOM = 12u, SLOTS = STACK_SIZE + LEAF_ROOM, MOST_LEAVES = LEAF_ROOM - 4u;
#else
const uint LEAF_ROOM = 12u, SLOTS = STACK_SIZE + LEAF_ROOM, MOST_LEAVES = LEAF_ROOM - 2u;
#endif
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
#if BALLOT_MASKS
  ray_mask = ray_masks[inside ? index : push.ray_begin];
#endif
  bool truncated = false;
  do {
    while (is_inner(node) && leaves <= MOST_LEAVES) {
#if BALLOT_WIDE
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
      TAKE_CHILD(pair.left, meets(w, pair.l, entry_l))
      TAKE_CHILD(pair.right, meets(w, pair.r, entry_r))
#endif
      node = stack[--top];
    }
    if (CUT_SHORT(is_inner(node) && leaves <= MOST_LEAVES)) break;
    uint left = 0u, texel = 0u;  // triangles of the leaf that are still to be tested, and the next one
    while (leaves + left != 0u) {
      if (left == 0u) {
        uint leaf = stack[SLOTS - leaves--];
        texel = (leaf & LEAF_TEXEL_MASK) + LEAF_HEADER_TEXELS;
        left = (leaf >> LEAF_COUNT_SHIFT & 7u) + 1u;
      }
      Hit hit;
      bool crossed = crosses(w, texel, hit);
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
  if (inside) {
    bool cut_short = CUT_SHORT(live && (node != END_OF_TREE || truncated));
    answers[index] = cut_short ? UNFINISHED : found;
#if BALLOT_EXACT
    if (unsure && !cut_short) answers[index] = UNSURE;
#endif
    if (cut_short) atomicAdd(work.unfinished, 1u);
  }
}
