// Clusters and the nodes that they are stored as.
//
// The shape of a cluster, in 16 bits. Of one that a leaf could hold, three bits each for the inner nodes on its longest
// path, its inner nodes, and its leaves. Of others, the inner nodes on the longest path.
uint index_of(uint cluster) { return cluster & BUILD_INDEX_MASK; }
uint count_of(uint cluster) { return cluster >> BUILD_SIZE_SHIFT & 7u; }
bool is_leaf(uint cluster) { return cluster >= BUILD_LEAF; }
bool has_many(uint cluster) { return count_of(cluster) == BUILD_MANY; }
bool is_triangle(uint cluster) { return is_leaf(cluster) && count_of(cluster) == 1u; }
uint cluster_of(uint index, uint count) { return index | count << BUILD_SIZE_SHIFT; }

struct Shape {
  uint depth, inner, leaves;
};
const Shape LEAF_SHAPE = Shape(0u, 0u, 1u);
Shape shape_of(uint cluster, uint bits) {
  return has_many(cluster) ? Shape(bits, 0u, 0u) : Shape(bits & 7u, bits >> 3 & 7u, bits >> 6 & 7u);
}
uint bits_of(Shape s) { return s.depth | s.inner << 3 | s.leaves << 6; }

// A cluster while it is merged.
struct Item {
  vec3 lo, hi;
  float cost;    // by the SAH
  uint cluster;
  uint key;      // one of its positions in Morton order; no other cluster at hand has it
  uint sides_xy, side_z_shape;
};

// The longest extents of triangles, as the upper 16 bits of floats, rounded up.
uint upper_half(float x) { return (floatBitsToUint(x) + 0xFFFFu) >> 16; }
float from_half(uint half_word) { return uintBitsToFloat(half_word << 16); }
vec3 sides_of(uint xy, uint z_shape) {
  return vec3(from_half(xy & 0xFFFFu), from_half(xy >> 16), from_half(z_shape & 0xFFFFu));
}
uint max_halves(uint a, uint b) { return max(a & 0xFFFFu, b & 0xFFFFu) | max(a >> 16, b >> 16) << 16; }

#ifndef NODES_ACCESS
#define NODES_ACCESS readonly
#endif
layout(set = 0, binding = BIND_BUILD_NODES, std430) NODES_ACCESS buffer Nodes { uvec4 nodes[]; };
layout(set = 0, binding = BIND_BUILD_PRIMS, std430) readonly buffer Prims { uint prims[]; };

Item item_of_triangle(uint position, float triangle_cost) {
  Corners t = corners_of(prims[position]);
  vec3 lo = lo_of(t), hi = hi_of(t), sides = sides_of_corners(t);
  return Item(lo, hi, triangle_cost, BUILD_LEAF | cluster_of(position, 1u), position,
              upper_half(sides.x) | upper_half(sides.y) << 16, upper_half(sides.z) | bits_of(LEAF_SHAPE) << 16);
}

Item item_of_node(uint cluster) {
  uint at = index_of(cluster) * BUILD_NODE_TEXELS;
  uvec4 a = nodes[at], b = nodes[at + 1u], c = nodes[at + 2u];
  return Item(uintBitsToFloat(a.xyz), uintBitsToFloat(b.xyz), uintBitsToFloat(c.x), cluster, c.y, c.z, c.w);
}
