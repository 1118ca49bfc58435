#version 460
#extension GL_GOOGLE_include_directive : require
// Finds the best collapse of each subtree, bottom up, in one dispatch (lib/build/collapse.glsl): the least summed area
// of its wide nodes if it becomes up to n children of the node above, for each n.
//
// Tero Karras. Maximizing Parallelism in the Construction of BVHs, Octrees, and k-d Trees. HPG 2012 (the climb).
//
// A lane begins at a pair of two leaves and climbs, as in refit.comp: the lane that arrives at a pair last goes on. So
// no lane waits for another, and each climbs at most the depth of the tree.
#include "../lib/build/frame.glsl"

layout(push_constant, scalar) uniform Push { CollapsePush push; };
layout(set = 0, binding = BIND_BUILD_PARENTS, std430) readonly buffer Parents { uint parents[]; };
layout(set = 0, binding = BIND_BUILD_ARRIVALS, std430) coherent buffer Arrivals { uint arrivals[]; };
// Of each pair, WIDTH / 4 vectors: the costs if it becomes up to 1, 2, ... WIDTH - 1 children.
layout(set = 0, binding = BIND_BUILD_COSTS, std430) coherent buffer Costs { vec4 costs[]; };
#define CHOICES_ACCESS writeonly
#define BALLOT_LAYOUT LAYOUT_INTERLEAVED
#include "../lib/build/area.glsl"
#include "../lib/build/read_pair.glsl"
#include "../lib/build/collapse.glsl"

// The costs of a subtree that becomes up to n children, at n - 1. A leaf costs nothing.
struct CostsOf {
  float up_to[WIDTH];
};

CostsOf costs_of(uint ref) {
  CostsOf c;
  for (uint i = 0u; i < WIDTH / 4u; ++i) {
    vec4 part = ref >= LEAF_BIT ? vec4(0.0) : costs[pair_at(ref) * (WIDTH / 4u) + i];
    for (uint k = 0u; k < 4u; ++k) c.up_to[4u * i + k] = part[k];
  }
  return c;
}

void store_costs(uint pair, CostsOf c) {
  for (uint i = 0u; i < WIDTH / 4u; ++i)
    costs[pair * (WIDTH / 4u) + i] =
        vec4(c.up_to[4u * i], c.up_to[4u * i + 1u], c.up_to[4u * i + 2u], c.up_to[4u * i + 3u]);
}

void plan(uint pair) {
  Child l = read_child(texel_of(pair), 0u), r = read_child(texel_of(pair), 1u);
  CostsOf left = costs_of(l.ref), right = costs_of(r.ref), best;
  uint choice = choose_to_become(1u);
  for (uint n = 2u; n <= WIDTH; ++n) {  // the pair becomes exactly n children
    for (uint i = 1u; i < n; ++i) {
      precise float cost = left.up_to[i - 1u] + right.up_to[n - i - 1u];
      if (i > 1u && cost >= best.up_to[n - 1u]) continue;
      best.up_to[n - 1u] = cost;
      choice = choice & ~choose_left(7u, n) | choose_left(i, n);
    }
  }
  precise float own = best.up_to[WIDTH - 1u] + half_area(min(l.lo, r.lo), max(l.hi, r.hi));
  best.up_to[0] = own;
  for (uint n = 2u; n < WIDTH; ++n) {
    if (best.up_to[n - 2u] <= best.up_to[n - 1u])
      best.up_to[n - 1u] = best.up_to[n - 2u];
    else
      choice |= choose_to_become(n);
  }
  store_costs(pair, best);
  choices[pair] = choice;
}

void climb_from(uint pair) {
  bool live = pair < push.pairs;
  if (live) {
    uvec4 refs = pairs[texel_of(pair) + 3u];
    live = refs.x >= LEAF_BIT && refs.y >= LEAF_BIT;
  }
  while (subgroupAny(live)) {
    if (live) plan(pair);
    publish();  // costs are written before the arrival
    subgroup_sync();
    uint parent = BUILD_NONE;
    if (live) parent = parents[pair];
    live = parent != BUILD_NONE;
    pair = parent >> 1;
    if (live) live = atomicAdd(arrivals[pair], 1u) == 1u;
    publish();
    subgroup_sync();
  }
}

BUILD_MAIN {
  unit = push.unit;
  for (uint first = gl_WorkGroupID.x * GROUP_SIZE; first < push.pairs; first += gl_NumWorkGroups.x * GROUP_SIZE)
    climb_from(first + lane_of_group());
}
