#version 460
#extension GL_GOOGLE_include_directive : require
// Writes the device tree: pairs of siblings in one layout, and leaves with vertices. An invocation writes the room of a
// node (lib/build/places.glsl): its pair of children, the pairs of smaller nodes below it, and their leaves. Smaller
// nodes have no more triangles than a leaf may hold.
#include "../lib/build/frame.glsl"

layout(push_constant, scalar) uniform Push { WritePush push; };
layout(set = 0, binding = BIND_BUILD_STATE, scalar) readonly buffer State { BuildState state; };
layout(set = 0, binding = BIND_BUILD_NEEDS, std430) readonly buffer Needs { uint needs[]; };
layout(set = 0, binding = BIND_BUILD_STARTS, std430) readonly buffer Starts { uvec2 starts[]; };
layout(set = 0, binding = BIND_BUILD_LEAVES, std430) writeonly buffer Leaves { uvec4 leaves[]; };
#include "../lib/build/triangles.glsl"
#include "../lib/build/clusters.glsl"
#include "../lib/build/pairs.glsl"

uint pair_of(uint node) { return node == index_of(state.root) ? 0u : starts[node].x + 1u; }

void write_triangle(uint texel, uint prim) {
  Corners t = corners_of(prim);
  uvec3 a = floatBitsToUint(t.a), b = floatBitsToUint(t.b), c = floatBitsToUint(t.c);
  leaves[texel] = uvec4(a.x, b.x, c.x, prim);
  leaves[texel + 1u] = uvec4(a.y, b.y, c.y, prim);
  leaves[texel + 2u] = uvec4(a.z, b.z, c.z, prim);
}

// Writes the block of a leaf. Returns the texel behind it.
uint write_leaf(uint cluster, vec3 lo, vec3 hi, uint texel) {
  leaves[texel] = uvec4(floatBitsToUint(lo), count_of(cluster));
  leaves[texel + 1u] = uvec4(floatBitsToUint(hi), 0u);
  texel += LEAF_HEADER_TEXELS;
  uint todo[MAX_LEAF_TRIANGLES], left = 1u;
  todo[0] = cluster;
  while (left > 0u) {
    uint top = todo[--left];
    if (is_triangle(top)) {
      write_triangle(texel, prims[index_of(top)]);
      texel += TRIANGLE_TEXELS;
    } else {
      todo[left++] = nodes[index_of(top) * BUILD_NODE_TEXELS + 1u].w;
      todo[left++] = nodes[index_of(top) * BUILD_NODE_TEXELS].w;
    }
  }
  return texel;
}

// Where the next pair and the next leaf of the room go. The smaller nodes whose pairs are still to be written, and the
// places of these pairs.
uint next_pair, next_texel;
uint open_nodes[8], open_pairs[8], open_count;

Child child_of(uint cluster) {
  Item item;
  if (is_triangle(cluster))
    item = item_of_triangle(index_of(cluster), 0.0);
  else
    item = item_of_node(cluster);
  precise vec3 lo = item.lo - state.origin, hi = item.hi - state.origin;
  Child child = Child(lo, hi, 0u);
  if (is_leaf(cluster)) {
    child.ref = LEAF_BIT | (count_of(cluster) - 1u) << LEAF_COUNT_SHIFT | next_texel;
    next_texel = write_leaf(cluster, lo, hi, next_texel);
  } else if (has_many(cluster)) {
    child.ref = pair_of(index_of(cluster)) * PAIR_TEXELS(BALLOT_LAYOUT);
  } else {
    child.ref = next_pair * PAIR_TEXELS(BALLOT_LAYOUT);
    open_nodes[open_count] = index_of(cluster);
    open_pairs[open_count++] = next_pair++;
  }
#if BALLOT_PADDED
  pad_box(child.lo, child.hi, sides_of(item.sides_xy, item.side_z_shape));
#endif
  return child;
}

// Writes the pair of a node, and those of the smaller nodes below it. If one leaf holds the whole tree, writes a pair
// of this leaf and END_OF_TREE, because the formats of wide nodes (bvh4, bvh8) are made from pairs.
// child_of() and write_pair() are called at one place each: lavapipe takes long to compile further calls.
void write_room(uint node, uint pair, bool is_lone_leaf) {
  open_nodes[0] = node;
  open_pairs[0] = pair;
  open_count = 1u;
  while (open_count > 0u) {
    --open_count;
    uint at = open_nodes[open_count] * BUILD_NODE_TEXELS, to = open_pairs[open_count];
    Child children[2];
    for (uint side = 0u; side < (is_lone_leaf ? 1u : 2u); ++side) {
      Child child = child_of(is_lone_leaf ? state.root : nodes[at + side].w);
      if (side == 0u) children[0] = child;
      children[1] = child;
    }
    if (is_lone_leaf) children[1] = Child(vec3(3.402823466e38), vec3(-3.402823466e38), END_OF_TREE);
    write_pair(to, children[0], children[1]);
  }
}

// The pair of the root lies in front of all others. The one in the root's room is not used, and refers to nothing.
void mark_unused(uint pair) {
  for (uint i = 0u; i < PAIR_TEXELS(BALLOT_LAYOUT); ++i)
    pairs[pair * PAIR_TEXELS(BALLOT_LAYOUT) + i] = uvec4(END_OF_TREE);
}

void main() {
  for (uint i = gl_GlobalInvocationID.x; i < state.proper; i += gl_NumWorkGroups.x * GROUP_SIZE) {
    bool is_small = i == 0u && !has_many(state.root);  // a leaf could hold the whole tree
    if (needs[i] == 0u && !is_small) continue;
    if (!is_small && i == index_of(state.root)) mark_unused(starts[i].x + 1u);
    next_pair = is_small ? 1u : starts[i].x + 2u;
    next_texel = is_small ? 0u : starts[i].y;
    uint node = is_small ? index_of(state.root) : i;
    write_room(node, is_small ? 0u : pair_of(i), is_small && is_leaf(state.root));
  }
}
