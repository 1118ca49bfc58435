// Tests the frontier of the tree (shared/layout.h) against bounds of all rays of a subgroup, one node a lane.
#include "format.glsl"

struct FrontierNode {
  vec3 lo, hi;
  uint child;
};

FrontierNode fetch_frontier(uint i) {
  uvec4 a = format_texel(2u * i), b = format_texel(2u * i + 1u);
  return FrontierNode(uintBitsToFloat(a.xyz), uintBitsToFloat(b.xyz), a.w);
}

// Bounds of all rays of a subgroup. For rays that end inside the reach of the scene (segments), this is the box of all
// their points. For longer rays, which must share one octant of directions, it is bounds of the origins that planes are
// measured from, and bounds of the reciprocal direction.
struct Beam {
  bool segments;
  uint octant;
  vec3 lo, hi;            // segments: the box; else the largest origin of lower planes, the smallest of upper planes
  vec3 inv_min, inv_max;  // not for segments
  float t_min;            // a lower bound of the rays' t_min
};

// Computes the bounds. Returns false if long rays have no common octant.
bool make_beam(Walker w, bool live, out Beam b) {
  bvec3 down = lessThan(w.slabs.inv, vec3(0.0));
  bvec3 some = bvec3(subgroupAny(live && down.x), subgroupAny(live && down.y), subgroupAny(live && down.z));
  b.octant = uint(some.x) | uint(some.y) << 1 | uint(some.z) << 2;
  b.segments = subgroupAll(!live || w.ray.t_max < scene_reach(w.ray.origin));
  b.t_min = subgroupAny(live && w.ray.t_min < 0.0) ? -LARGEST : 0.0;
  if (b.segments) {
    vec3 origin = from_box_origin(w.ray.origin);
    vec3 begin = origin + min(w.ray.t_min, 0.0) * w.ray.dir, end = origin + w.ray.t_max * w.ray.dir;
    vec3 pad = segment_pad(w.ray);
    b.lo = lanes_min(live ? smaller(begin, end) - pad : vec3(LARGEST));
    b.hi = lanes_max(live ? larger(begin, end) + pad : vec3(-LARGEST));
    return true;
  }
#if BALLOT_BOX == BOX_WIDENED
  if (!subgroupAll(!live || (down == some && has_slabs(w.slabs)))) return false;
#else
  if (!subgroupAll(!live || down == some)) return false;
#endif
  vec3 lo_origin, hi_origin;
  slab_origins(w.slabs, w.ray, lo_origin, hi_origin);
  b.lo = lanes_max(live ? lo_origin : vec3(-LARGEST));
  b.hi = lanes_min(live ? hi_origin : vec3(LARGEST));
#if BALLOT_BOX == BOX_WIDENED || BALLOT_BOX == BOX_RELATIVE
  // Stretches intervals by way of the reciprocals. NVIDIA's compiler (580.159) compiled beam_may_meet() wrongly when a
  // multiply-add there stretched the exit.
  vec3 slack = BEAM_SLACK * abs(w.slabs.inv);
#else
  const vec3 slack = vec3(0.0);
#endif
  b.inv_min = lanes_min(live ? w.slabs.inv - slack : vec3(LARGEST));
  b.inv_max = lanes_max(live ? w.slabs.inv + slack : vec3(-LARGEST));
  return true;
}

// Returns true if a ray of the beam may meet the box. Subtraction and multiplication are monotone, and so is their
// rounding: no ray enters before `entry` or leaves after `exit`.
bool beam_may_meet(Beam b, vec3 lo, vec3 hi) {
  if (b.segments) return all(lessThanEqual(lo, b.hi)) && all(lessThanEqual(b.lo, hi));
  bvec3 down = lessThan(b.inv_max, vec3(0.0));
  precise vec3 from_lo = lo - b.lo, from_hi = hi - b.hi;
  vec3 near = mix(from_lo, from_hi, down), far = mix(from_hi, from_lo, down);
  precise vec3 near_a = near * b.inv_min, near_b = near * b.inv_max, far_a = far * b.inv_min, far_b = far * b.inv_max;
  vec3 entry = smaller(near_a, near_b), exit = larger(far_a, far_b);
  return larger(larger(entry.x, entry.y), larger(entry.z, b.t_min)) <= smaller(smaller(exit.x, exit.y), exit.z);
}

// A set of frontier nodes, a bit each, the nearest node first.
struct Entries {
  uint first;  // frontier node of bit 0
  uvec2 left;
};

bool has_entries(Entries e) { return (e.left.x | e.left.y) != 0u; }

uint take_entry(inout Entries e) {
  bool later = e.left.x == 0u;
  uint bits = later ? e.left.y : e.left.x, rest = bits & bits - 1u;
  e.left = later ? uvec2(0u, rest) : uvec2(rest, e.left.y);
  return e.first + uint(findLSB(bits)) + (later ? 32u : 0u);
}

// Returns the frontier nodes that a ray of the beam may meet.
Entries entries_of(Beam b, bool live) {
  Entries e = Entries(b.octant * FRONTIER_NODES, uvec2(0u));
  uint base = 0u;
  do {
    COUNT_SHARED(true)
    COUNT_NODE(live)
    COUNT_SHARED(false)
    uint i = base + gl_SubgroupInvocationID;
    FrontierNode node = fetch_frontier(e.first + min(i, FRONTIER_NODES - 1u));
    bool met = i < FRONTIER_NODES && node.child != END_OF_TREE && beam_may_meet(b, node.lo, node.hi);
    uvec4 lanes = subgroupBallot(met);
    if (SUBGROUP_SIZE > 32u)
      e.left = lanes.xy;
    else if (base < 32u)
      e.left.x |= lanes.x << base;
    else
      e.left.y |= lanes.x << base - 32u;
    base += SUBGROUP_SIZE;
  } while (base < FRONTIER_NODES);
  return e;
}
