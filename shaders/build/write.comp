#version 460
#extension GL_GOOGLE_include_directive : require
// Writes the device tree: pairs of siblings in one layout, and leaves with vertices. An invocation writes the room of a
// node (lib/build/places.glsl): its pair of children, the pairs of smaller nodes below it, and their leaves.
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

// The rest of a room, and the smaller nodes whose pairs are still to be written.
struct Room {
  uint pair, texel;
  uint nodes[8], pairs[8], left;
};

Child child_of(uint cluster, inout Room room) {
  Item item = is_triangle(cluster) ? item_of_triangle(index_of(cluster), 0.0) : item_of_node(cluster);
  precise vec3 lo = item.lo - state.origin, hi = item.hi - state.origin;
  Child child = Child(lo, hi, 0u);
  if (is_leaf(cluster)) {
    child.ref = LEAF_BIT | (count_of(cluster) - 1u) << LEAF_COUNT_SHIFT | room.texel;
    room.texel = write_leaf(cluster, lo, hi, room.texel);
  } else if (has_many(cluster)) {
    child.ref = pair_of(index_of(cluster)) * PAIR_TEXELS(BALLOT_LAYOUT);
  } else {
    child.ref = room.pair * PAIR_TEXELS(BALLOT_LAYOUT);
    room.nodes[room.left] = index_of(cluster);
    room.pairs[room.left++] = room.pair++;
  }
#if BALLOT_PADDED
  pad_box(child.lo, child.hi, sides_of(item.sides_xy, item.side_z_shape));
#endif
  return child;
}

void write_room(uint node, uint pair, Room room) {
  room.nodes[0] = node;
  room.pairs[0] = pair;
  room.left = 1u;
  while (room.left > 0u) {
    --room.left;
    uint at = room.nodes[room.left] * BUILD_NODE_TEXELS, to = room.pairs[room.left];
    Child l = child_of(nodes[at].w, room), r = child_of(nodes[at + 1u].w, room);
    write_pair(to, l, r);
  }
}

// A tree of so few triangles that a leaf could hold them.
void write_small_tree() {
  Room room;
  room.pair = 1u;
  room.texel = 0u;
  room.left = 0u;
  if (is_leaf(state.root))
    child_of(state.root, room);
  else
    write_room(index_of(state.root), 0u, room);
}

void main() {
  if (gl_GlobalInvocationID.x == 0u && state.proper > 0u && !has_many(state.root)) write_small_tree();
  for (uint i = gl_GlobalInvocationID.x; i < state.proper; i += gl_NumWorkGroups.x * GROUP_SIZE) {
    if (needs[i] == 0u) continue;
    Room room;
    room.pair = starts[i].x + 2u;
    room.texel = starts[i].y;
    write_room(i, pair_of(i), room);
  }
}
