// Tests a ray against the four children of a node of the four-wide tree (shared/layout.h).
#include "format.glsl"

// A node of the four-wide tree.
struct Bvh4Node {
  vec3 first, step;
  uvec3 lower, upper;  // a byte a child
  uvec4 child;
};

Bvh4Node fetch_bvh4(uint node) {
  uvec4 a = format_texel(node), b = format_texel(node + 1u), c = format_texel(node + 2u);
  return Bvh4Node(uintBitsToFloat(a.xyz), uintBitsToFloat(uvec3(a.w, b.w, c.w)), b.xyz, c.xyz, format_texel(node + 3u));
}

// The part of the plane distances that all children of a node share: t at a plane is a number of steps times `step`,
// plus `near` or `far`. For a ray from so far away that these overflow, nothing is culled: an infinite t is beyond the
// ray's range, and NaN loses every comparison.
struct Bvh4Planes {
  uvec3 nearer, farther;  // a byte a child
  vec3 near, far, step;
};

Bvh4Planes planes_of(Walker w, Bvh4Node q) {
  Bvh4Planes p;
  bvec3 down = lessThan(w.slabs.inv, vec3(0.0));
  p.nearer = mix(q.lower, q.upper, down);
  p.farther = mix(q.upper, q.lower, down);
  precise vec3 step = q.step * w.slabs.inv;
  p.step = step;
  first_planes(w.slabs, q.first, step, p.near, p.far);
  return p;
}

vec3 steps_of(uvec3 bytes, uint child) { return vec3(ivec3(bytes >> 8u * child & 255u)); }

// Returns t at the entry of a child's box if the ray meets the box no later than at `reach`, otherwise infinity.
#define NOT_MET uintBitsToFloat(0x7F800000u)
float entry_of(Bvh4Planes p, uint child, float t_min, float reach) {
  precise vec3 near = fma(steps_of(p.nearer, child), p.step, p.near),
               far = fma(steps_of(p.farther, child), p.step, p.far);
  float entry = larger(larger(near.x, near.y), larger(near.z, t_min));
  float exit = stretched_end(smaller(smaller(far.x, far.y), smaller(far.z, reach)));
  return entry <= exit ? entry : NOT_MET;
}

// Swaps the pairs (a, x) and (b, y) if b < a.
void put_in_order(inout float a, inout uint x, inout float b, inout uint y) {
  bool swap = b < a;
  float lesser = swap ? b : a;
  uint first = swap ? y : x;
  b = swap ? a : b;
  y = swap ? x : y;
  a = lesser;
  x = first;
}

// Returns how many children the ray meets. Sorts `child` by entry, so that these come first.
uint met_children(Walker w, uint node, out uvec4 child) {
  Bvh4Node q = fetch_bvh4(node);
  Bvh4Planes p = planes_of(w, q);
  float t_min = w.ray.t_min, far = reach(w.space, w.hit);
  float a = entry_of(p, 0u, t_min, far), b = entry_of(p, 1u, t_min, far), c = entry_of(p, 2u, t_min, far),
        d = entry_of(p, 3u, t_min, far);
  if (q.child.z == END_OF_TREE) c = NOT_MET;
  if (q.child.w == END_OF_TREE) d = NOT_MET;
  child = q.child;
  uint met = uint(a != NOT_MET) + uint(b != NOT_MET) + uint(c != NOT_MET) + uint(d != NOT_MET);
  put_in_order(a, child.x, b, child.y);
  put_in_order(c, child.z, d, child.w);
  put_in_order(a, child.x, c, child.z);
  put_in_order(b, child.y, d, child.w);
  put_in_order(b, child.y, c, child.z);
  return met;
}

// Continues to the nearest child that the ray meets and pushes the others. Pops the stack if the ray meets none.
#if BALLOT_PUSH == PUSH_ALWAYS
#define WALK_BVH4(w, node, top)                     \
  {                                                 \
    COUNT_NODE(true)                                \
    uvec4 child;                                    \
    uint met = met_children(w, node, child);        \
    uint popped = STACK_AT(top - 1u);               \
    STACK_AT(top) = child.w;                        \
    top += uint(met > 3u);                          \
    STACK_AT(top) = child.z;                        \
    top += uint(met > 2u);                          \
    STACK_AT(top) = child.y;                        \
    top += uint(met > 1u);                          \
    COUNT_STACK(top)                                \
    top -= uint(met == 0u);                         \
    node = met == 0u ? popped : child.x;            \
  }
#else
#define WALK_BVH4(w, node, top)                  \
  {                                              \
    COUNT_NODE(true)                             \
    uvec4 child;                                 \
    uint met = met_children(w, node, child);     \
    if (met > 3u) STACK_AT(top++) = child.w;     \
    if (met > 2u) STACK_AT(top++) = child.z;     \
    if (met > 1u) STACK_AT(top++) = child.y;     \
    COUNT_STACK(top)                             \
    node = child.x;                              \
    if (met == 0u) node = STACK_AT(--top);       \
  }
#endif
