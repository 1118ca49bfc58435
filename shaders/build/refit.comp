#version 460
#extension GL_GOOGLE_include_directive : require
// Gives the nodes of the binary tree the boxes of triangles that have moved, bottom up, in one dispatch: boxes, costs
// by the SAH, and the longest extents of the triangles below. The shape of the tree stays.
//
// Tero Karras. Maximizing Parallelism in the Construction of BVHs, Octrees, and k-d Trees. HPG 2012 (the climb).
//
// A lane begins at a triangle and climbs by the parents that parents.comp has written. At each node one of the two
// children arrives first: its lane stops. The one that arrives last finds both children finished, and goes on. So no
// lane waits for another, and each climbs at most the depth of the tree. An arrival flips a bit, so that the bits are
// zero again afterwards. Costs are summed in the order of the tree: they are the same in every run.
#include "../lib/build/frame.glsl"

layout(push_constant, scalar) uniform Push { RefitPush push; };
layout(set = 0, binding = BIND_BUILD_STATE, scalar) buffer State { BuildState state; };
layout(set = 0, binding = BIND_BUILD_CLUSTERS, std430) readonly buffer Parents { uint parents[]; };
layout(set = 0, binding = BIND_BUILD_ARRIVALS, std430) coherent buffer Arrivals { uint arrivals[]; };
#define NODES_ACCESS coherent
#include "../lib/build/triangles.glsl"
#include "../lib/build/area.glsl"
#include "../lib/build/clusters.glsl"
#include "../lib/build/refit.glsl"

// Finishes a node whose children are finished. Returns its parent.
uint refit_node(uint node) {
  uint at = node * BUILD_NODE_TEXELS;
  uint clusters[2] = uint[2](nodes[at].w, nodes[at + 1u].w);
  uvec4 rest = nodes[at + 2u];
  vec3 lo = vec3(0.0), hi = vec3(0.0);
  float costs[2];
  uint sides_xy = 0u, side_z = 0u;
  for (uint side = 0u; side < 2u; ++side) {  // one call: lavapipe takes long to compile it
    Item child = refitted(clusters[side]);
    lo = side == 0u ? child.lo : min(lo, child.lo);
    hi = side == 0u ? child.hi : max(hi, child.hi);
    costs[side] = child.cost;
    sides_xy = max_halves(sides_xy, child.sides_xy);
    side_z = max(side_z, child.side_z_shape & 0xFFFFu);
  }
  float cost = half_area(lo, hi) * push.traversal_cost + costs[0] + costs[1];
  nodes[at] = uvec4(floatBitsToUint(lo), clusters[0]);
  nodes[at + 1u] = uvec4(floatBitsToUint(hi), clusters[1]);
  nodes[at + 2u] = uvec4(floatBitsToUint(cost), rest.y, sides_xy, side_z | (rest.w & 0xFFFF0000u));
  return rest.y;
}

void climb_from(uint position, uint root, uint proper) {
  bool live = position < proper && proper > 1u;
  uint node = 0u;
  if (live) node = parents[position];
  while (subgroupAny(live)) {
    publish();  // nodes are written before the arrival
    subgroup_sync();
    if (live) live = atomicXor(arrivals[node], 1u) != 0u;
    publish();
    subgroup_sync();
    if (live) {
      uint parent = refit_node(node);
      live = node != root;
      node = parent;
    }
  }
}

BUILD_MAIN {
  unit = push.unit;
  uint root = index_of(state.root), proper = state.proper;
  for (uint first = gl_WorkGroupID.x * GROUP_SIZE; first < push.triangles; first += gl_NumWorkGroups.x * GROUP_SIZE) {
    uint position = first + lane_of_group();
    if (position >= proper && position < push.triangles && !has_no_area(corners_of(prims[position]))) changed = true;
    climb_from(position, root, proper);
  }
  if (changed) state.changed = 1u;
}
