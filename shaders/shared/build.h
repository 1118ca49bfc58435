// Records, push constants and bindings of the kernels that build the tree on the device (shaders/build/,
// engine/tree/device/).
#ifndef BALLOT_BUILD_H
#define BALLOT_BUILD_H

#include "layout.h"

// Specialisation constants of the builder's kernels: the invocations of a workgroup and of a subgroup, and the
// subgroups of a workgroup.
#define BUILD_SPEC_GROUP 0
#define BUILD_SPEC_SUBGROUP 1
#define BUILD_SPEC_GROUP_SUBGROUPS 2

// Bindings of set 0.
#define BIND_BUILD_STATE 0
#define BIND_BUILD_TRIANGLES 1  // nine floats a triangle, in prim order
#define BIND_BUILD_KEYS 2       // Morton codes; input of a sorting pass
#define BIND_BUILD_KEYS_OUT 3
#define BIND_BUILD_PRIMS 4  // prim of each key; input of a sorting pass
#define BIND_BUILD_PRIMS_OUT 5
#define BIND_BUILD_COUNTS 6    // sorting: keys of each digit in each tile; placing: sums of blocks
#define BIND_BUILD_TOTALS 7    // sorting: keys of each digit
#define BIND_BUILD_CLUSTERS 8  // clusters of each range of keys; of a refit: the parent node of each triangle
#define BIND_BUILD_ARRIVALS 9  // the other end of the range that arrived first at each boundary between two keys; of a
                               // refit: whether a child of each node has arrived
#define BIND_BUILD_NODES 10    // BUILD_NODE_TEXELS texels a node
#define BIND_BUILD_NEEDS 11    // what a node needs in the device tree
#define BIND_BUILD_STARTS 12   // where it starts: pair, texel of leaves
#define BIND_BUILD_PAIRS 13    // the tree
#define BIND_BUILD_LEAVES 14
#define BIND_BUILD_FRONTIER 19  // nodes near the root, for each octant (layout.h)
// Of pairs that are collapsed into wide nodes (shaders/lib/build/collapse.glsl), where needs and starts are those of
// pairs, arrivals count the children of each pair, and the state is a CollapseTotals.
#define BIND_BUILD_PARENTS 20     // of each pair: the pair above, doubled, plus 1 on its right side
#define BIND_BUILD_COSTS 21       // of each pair: areas of the wide nodes below, for each number of children
#define BIND_BUILD_CHOICES 22     // of each pair: how it is collapsed
#define BIND_BUILD_WIDE_NODES 23  // the pair of each wide node
#define BIND_BUILD_FORMAT 24      // the wide tree (layout.h)
#define BIND_BUILD_ARGS 25        // sorting with BALLOT_INDIRECT: indirect arguments that count the keys
// Of instances. Where a tree is built over their boxes, these lie in the place of the triangles.
#define BIND_BUILD_TRANSFORMS 15  // twelve floats an instance
#define BIND_BUILD_PARTS 16       // of each instance its mesh and the number of its first triangle
#define BIND_BUILD_MESHES 17      // MeshExtent of each mesh
#define BIND_BUILD_TOP 18         // the top-level tree: room for a node an instance, then the records of the instances

// Sorting. A pass sorts by a digit of eight bits. A tile is what a workgroup sorts: BUILD_TILE_KEYS keys an invocation.
#define BUILD_DIGITS 256
#define BUILD_GROUP_SUBGROUPS 8
#define BUILD_TILE_KEYS 16

// A cluster, as the builder refers to it: a triangle, a leaf or an inner node. The lowest 28 bits are the position of a
// triangle in Morton order, or the number of a node. Above them come three bits with the number of triangles, where
// BUILD_MANY stands for more than a leaf may hold. The top bit is set for triangles and for nodes that are leaves.
#define BUILD_LEAF 0x80000000u
#define BUILD_SIZE_SHIFT 28
#define BUILD_INDEX_MASK 0x0FFFFFFFu
#define BUILD_MANY 7u
#define BUILD_NONE 0xFFFFFFFFu

// Clusters are merged until BUILD_KEPT are left of a range of keys, so a merge begins with twice as many at most. A
// cluster looks for its nearest neighbour among BUILD_RADIUS clusters on each side.
#define BUILD_KEPT 16
#define BUILD_ITEMS 32
#define BUILD_RADIUS 8

// A node: (lo.xyz, left), (hi.xyz, right), (cost, key, sides x and y, side z and shape), where left and right are
// clusters, key is one of the cluster's positions in Morton order, sides are the longest extents of the triangles below
// in 16 bits each, rounded up, and shape is described in shaders/lib/build/clusters.glsl. Once the tree has been
// refitted, key is the parent node instead; the root keeps its key.
#define BUILD_NODE_TEXELS 3

// Placing. A block of BUILD_BLOCK nodes is summed up by one workgroup.
#define BUILD_BLOCK 1024

#ifdef __cplusplus
namespace ballot {
#endif

// The counters and facts of a build. Bounds are those of all triangles with area, as integers of the same order
// (shaders/lib/build/order.glsl).
struct BuildState {
  uint lo[3], hi[3];
  uint proper;  // triangles with area
  uint root;    // cluster of the root; BUILD_NONE: not built
  uint pairs;   // pairs of the tree, the one of the root included
  uint texels;  // texels of leaves
  uint depth;   // inner nodes on the longest path
  float cost;   // of the whole tree by the SAH, in units of the square of the longest side
  vec3 corner;  // lower corner of the bounds
  float longest;
  vec3 scale;                   // steps of the Morton grid in a unit of length, by axis
  uint bits_x, bits_y, bits_z;  // bits of the Morton code, by axis
  vec3 origin;                  // the point that boxes are measured from
  uint axes[4];                 // axis of each bit of the code, from the highest on, in two bits each
  uint changed;                 // 1: a refit met a triangle that has gained or lost its area since the build
  uint refused;                 // the first instance whose transform cannot be placed; BUILD_NONE: there is none
};
BALLOT_RECORD(BuildState, 124);

// A mesh as its instances are placed by it (MeshExtents of engine/tree/host/instance.h).
struct MeshExtent {
  vec3 lo, hi;    // of its tree
  vec3 triangle;  // the largest extent of a triangle along each axis
  uint empty;     // 1: no triangle can be hit
};
BALLOT_RECORD(MeshExtent, 40);

// Push constants of bounds.comp, frame.comp and codes.comp.
struct BuildPush {
  uint triangles;
  uint bits;  // of a Morton code
};

// Push constants of the kernels that sort.
struct SortPush {
  uint keys;   // with BALLOT_INDIRECT: their number at most
  uint tiles;
  uint shift;  // of the digit
  uint first;  // 1: the first pass, where the prim of a key is its index
  uint args;   // with BALLOT_INDIRECT: which indirect arguments
};

// Push constants of cluster.comp: the costs of the SAH.
struct ClusterPush {
  uint triangles;
  uint max_leaf;
  float traversal_cost;
  float intersection_cost;
};

// The counts of a wide tree.
struct CollapseTotals {
  uint nodes;
  uint list_texels;  // texels of the lists of leaves, in bvh8
};
BALLOT_RECORD(CollapseTotals, 8);

// In the needs of a pair: it is a wide node.
#define COLLAPSE_NODE 0x80000000u

// Push constants of the kernels collapse_*.comp.
struct CollapsePush {
  uint pairs;
  float unit;  // 1 over the length that areas are measured in the square of
};

// Push constants of the kernels encode_*.comp.
struct EncodePush {
  uint nodes;
};

// Push constants of needs.comp and places.comp.
struct PlacePush {
  uint nodes;
  uint blocks;
};

// Push constants of write.comp and parents.comp.
struct WritePush {
  uint triangles;
};

// Push constants of frontier.comp.
struct FrontierPush {
  uint root;   // child reference
  uint nodes;  // in the frontier: at most 64
};

// Push constants of instances.comp.
struct InstancePush {
  uint instances;
};

// Push constants of refit.comp and refit_end.comp: the costs of the SAH, and 1 over the length that areas are measured
// in the square of.
struct RefitPush {
  uint triangles;
  float unit;
  float traversal_cost;
  float intersection_cost;
};

#ifdef __cplusplus
}  // namespace ballot
#endif

#endif  // BALLOT_BUILD_H
