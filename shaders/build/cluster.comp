#version 460
#extension GL_GOOGLE_include_directive : require
// Makes the binary tree, bottom up, in one dispatch.
//
// Carsten Benthin, Daniel Meister, Joshua Barczak, Rohan Mehalwal, John Tsakok, Andrew Kensler. H-PLOC: Hierarchical
// Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy Construction. HPG 2024; Ciprian Apetrei. Fast and
// Simple Agglomerative LBVH Construction. CGVC 2014 (the climb).
//
// A lane begins at a key and climbs the binary radix tree of the keys, which is never stored. At each node one of the
// two children arrives first: its lane stores its range and stops. The one that arrives last goes on with both ranges.
// So no lane waits for another. Where a range has more than BUILD_KEPT keys, the subgroup of the lane merges the
// clusters of both halves until BUILD_KEPT are left, and at the root until one is left. Differs: the number of a node
// is a key that no other node has, so nodes need no counter, lie in Morton order and are the same in every run.
#include "../lib/build/frame.glsl"
#include "../lib/build/keys.glsl"

layout(push_constant, scalar) uniform Push { ClusterPush push; };
layout(set = 0, binding = BIND_BUILD_STATE, scalar) buffer State { BuildState state; };
layout(set = 0, binding = BIND_BUILD_KEYS, std430) readonly buffer Keys { Key keys[]; };
layout(set = 0, binding = BIND_BUILD_CLUSTERS, std430) coherent buffer Clusters { uint clusters[]; };
layout(set = 0, binding = BIND_BUILD_ARRIVALS, std430) coherent buffer Arrivals { uint arrivals[]; };
layout(set = 0, binding = BIND_BUILD_NEEDS, std430) writeonly buffer Needs { uint needs[]; };

#define NODES_ACCESS coherent
#include "../lib/build/triangles.glsl"
#include "../lib/build/area.glsl"
#include "../lib/build/clusters.glsl"
#include "../lib/build/merge.glsl"

Item item_of(uint cluster) {
  if (!is_triangle(cluster)) return item_of_node(cluster);
  Item item = item_of_triangle(index_of(cluster), 0.0);
  item.cost = half_area(item.lo, item.hi) * push.intersection_cost;
  return item;
}

// Loads the clusters of the keys [first, split) and [split, last], BUILD_KEPT of each at most. Returns how many. The
// clusters of a range of BUILD_KEPT keys or fewer are its triangles, and nobody stored them.
uint load_items(uint first, uint split, uint last) {
  uint found[STEPS], valid = 0u;
  for (uint step = 0u; step < STEPS; ++step) {
    uint place = step * SUBGROUP_SIZE + gl_SubgroupInvocationID;
    bool right = place >= BUILD_KEPT;
    uint begin = right ? split : first, end = right ? last + 1u : split, at = begin + (place & (BUILD_KEPT - 1u));
    found[step] = BUILD_NONE;
    if (place < BUILD_ITEMS && at < end)
      found[step] = end - begin > BUILD_KEPT ? clusters[at] : BUILD_LEAF | cluster_of(at, 1u);
    valid |= places_of(subgroupBallot(found[step] != BUILD_NONE), step);
  }
  for (uint step = 0u; step < STEPS; ++step) {
    uint place = step * SUBGROUP_SIZE + gl_SubgroupInvocationID;
    if (found[step] != BUILD_NONE) {
      Item item = item_of(found[step]);
      uint at = bitCount(valid & places_below(place));
      put_box(at, item.lo, item.hi, at);
      put_rest(at, item);
    }
  }
  return bitCount(valid);
}

// Stores the remaining clusters of the range [first, last], and BUILD_NONE in the other slots of its first BUILD_KEPT.
void store_items(uint from, uint count, uint first, uint last) {
  for (uint place = gl_SubgroupInvocationID; place < BUILD_KEPT; place += SUBGROUP_SIZE)
    if (first + place <= last)
      clusters[first + place] = place < count ? slot_words[slots_at + slot_at(from + place)] : BUILD_NONE;
}

void store_root(uint from, uint triangles) {
  if (gl_SubgroupInvocationID != 0u) return;
  Item root = get_item(from);
  Shape shape = shape_of(root.cluster, root.side_z_shape >> 16);
  state.root = root.cluster;
  state.cost = root.cost;
  state.depth = shape.depth;
  state.pairs = shape.inner;  // of a tree with many triangles they are summed up later
  state.texels = shape.leaves * LEAF_HEADER_TEXELS + triangles * TRIANGLE_TEXELS;
  needs[root.key] = 0u;
}

void merge_range(uint first, uint split, uint last, bool root) {
  uint count = load_items(first, split, last), from = 0u, target = root ? 1u : BUILD_KEPT;
  subgroup_sync();
  while (count > target) {
    find_nearest(from, count);
    subgroup_sync();
    count = merge_round(from, BUILD_ITEMS - from, count);
    from = BUILD_ITEMS - from;
    subgroup_sync();
  }
  if (root)
    store_root(from, last + 1u);
  else
    store_items(from, count, first, last);
  subgroup_sync();
}

// Returns true if the keys at a and a + 1 have a longer common prefix than those at b and b + 1. x and y: their
// differences.
bool has_longer_prefix(uint a, uvec2 x, uint b, uvec2 y) {
  if (x.x != y.x) return x.x < y.x;
  if (x.y != y.y) return x.y < y.y;
  return (a ^ (a + 1u)) < (b ^ (b + 1u));
}

// Goes to the parent of the range [first, last]. Returns false if its other child has not arrived yet.
bool climb(inout uint first, inout uint last, out uint split, uint count, inout uvec2 before, inout uvec2 behind) {
  bool right = first == 0u || (last != count - 1u && has_longer_prefix(last, behind, first - 1u, before));
  uint other = atomicExchange(arrivals[right ? last : first - 1u], right ? first : last);
  split = right ? last + 1u : first;
  if (other == BUILD_NONE) return false;
  if (right)
    last = other;
  else
    first = other;
  uint at = right ? last : first - 1u;
  uvec2 at_end = uvec2(0u);
  if (at < count - 1u) at_end = difference(keys[at], keys[at + 1u]);
  if (right)
    behind = at_end;
  else
    before = at_end;
  return true;
}

void climb_from(uint key, uint count) {
  bool live = key < count;
  uint first = key, last = key, split = key;
  uvec2 before = uvec2(0u), behind = uvec2(0u);
  if (live && key > 0u) before = difference(keys[key - 1u], keys[key]);
  if (live && key < count - 1u) behind = difference(keys[key], keys[key + 1u]);
  bool fresh = false;
  while (subgroupAny(live)) {
    if (fresh) publish();  // clusters and nodes are written before the arrival
    subgroup_sync();
    if (live) live = climb(first, last, split, count, before, behind);
    bool root = live && last - first == count - 1u;
    uvec4 merging = subgroupBallot(root || (live && last - first >= BUILD_KEPT));
    fresh = (merging.x | merging.y) != 0u;
    if (fresh) publish();
    subgroup_sync();
    while (merging.x != 0u || merging.y != 0u) {
      uint lane = merging.x != 0u ? findLSB(merging.x) : 32u + findLSB(merging.y);
      if (merging.x != 0u)
        merging.x &= merging.x - 1u;
      else
        merging.y &= merging.y - 1u;
      merge_range(subgroupShuffle(first, lane), subgroupShuffle(split, lane), subgroupShuffle(last, lane),
                  subgroupShuffle(uint(root), lane) != 0u);
    }
    if (root) live = false;
  }
}

BUILD_MAIN {
  uint count = state.proper;
  unit = unit_of(state.longest);
  begin_items();
  if (count == 1u && gl_GlobalInvocationID.x == 0u) {
    state.root = BUILD_LEAF | cluster_of(0u, 1u);
    state.cost = item_of(state.root).cost;
    state.texels = LEAF_HEADER_TEXELS + TRIANGLE_TEXELS;
    needs[0] = 0u;
  }
  if (count <= 1u) return;
  for (uint first = gl_WorkGroupID.x * GROUP_SIZE; first < count; first += gl_NumWorkGroups.x * GROUP_SIZE)
    climb_from(first + lane_of_group(), count);
}
