// Records that C++ and GLSL share. They hold only float, uint and vec3 under scalar layout, so no padding rule has to
// be remembered. C++ asserts the sizes, and a test writes each record on the device and compares the bytes.
#ifndef BALLOT_LAYOUT_H
#define BALLOT_LAYOUT_H

#include "knobs.h"

#ifdef __cplusplus
#include <cstdint>
#include <glm/vec3.hpp>
namespace ballot {
using uint = std::uint32_t;
using vec3 = glm::vec3;
#define BALLOT_RECORD(T, SIZE) static_assert(sizeof(T) == SIZE && alignof(T) == 4, #T " changed size")
#else
#define BALLOT_RECORD(T, SIZE)
#endif

// A ray. Traversal looks for a hit with t in [t_min, t_max]; t counts multiples of dir, which need not be of unit
// length. A ray with t_max <= t_min, or with a NaN or an infinite component, is dead: it is reported as a miss.
struct Ray {
  vec3 origin;  // scene units
  float t_min;
  vec3 dir;
  float t_max;
};
BALLOT_RECORD(Ray, 32);

// A hit. prim is the triangle's number in the order of the scene file, or NO_HIT on a miss. u and v are the barycentric
// weights of vertices 1 and 2. The t of a miss is infinity, u and v are 0.
struct Hit {
  float t;
  uint prim;
  float u;
  float v;
};
BALLOT_RECORD(Hit, 16);

// A node of the binary BVH in its reference form. Source: Vinkler, Traversal methods for GPU ray tracing, section 2,
// figure 1. Siblings are neighbours: the right child is node first + 1, and a pair starts at an even index and fills 64
// bytes. The paper converts count and first to float; here they stay integers, which are exact beyond 2^24.
struct BvhNode {
  vec3 lo;     // scene units
  vec3 hi;     // hi >= lo on each axis
  uint count;  // leaf: 1..MAX_LEAF_TRIANGLES references. Inner node: 0
  uint first;  // leaf: index of its first reference. Inner node: index of its left child
};
BALLOT_RECORD(BvhNode, 32);

#define NO_HIT 0xFFFFFFFFu

// The arguments of an indirect dispatch: the workgroup counts, which the device reads, then the ray count, which the
// kernel reads.
struct IndirectArgs {
  uint groups_x, groups_y, groups_z;
  uint count;  // rays, from the start of the ray buffer on
};
BALLOT_RECORD(IndirectArgs, 16);

// The bindings of set 0 that all kernels share.
#define BIND_RAYS 0
#define BIND_HITS 1

// A child reference in a device layout is one word. For an inner node it is the texel (16 bytes) at which the pair of
// its children starts. For a leaf the top bit is set; below it come count - 1 in three bits and the texel at which the
// leaf's block starts in the leaf array. END_OF_TREE is the sentinel at the bottom of every stack.
#define LEAF_BIT 0x80000000u
#define LEAF_COUNT_SHIFT 28
#define LEAF_TEXEL_MASK 0x0FFFFFFFu
#define END_OF_TREE 0xFFFFFFFFu
#define MAX_LEAF_TRIANGLES 6

// Boxes of nodes and leaves, in every tree, are measured from zero on most axes. On an axis where the scene is far from
// zero they are measured from the middle of the scene (box_origin(), engine/tree/host/bvh.h). Vertices keep their own
// coordinates.

// A leaf block: two texels with the leaf's own box, (lo.xyz, count) and (hi.xyz, x), then three texels for each
// triangle in the format that the triangle test asks for.
//   LEAVES_VERTICES  by coordinate, so that a test can read the coordinates in the order that suits its ray:
//                    (v0.x, v1.x, v2.x, prim), then the same for y and for z; x = 0
//   LEAVES_AFFINE    the rows z, x, y of the affine map that takes v0, v1, v2 to (0,0,0), (1,0,0), (0,1,0), all zero
//                    for a degenerate triangle; x is the texel where the block's prims begin, four to a texel, behind
//                    all blocks
#define LEAVES_VERTICES 0
#define LEAVES_AFFINE 1
#define LEAF_HEADER_TEXELS 2
#define TRIANGLE_TEXELS 3

// Layouts of a pair of sibling nodes on the device, in PAIR_TEXELS texels.
//   LAYOUT_PAPER        64 bytes. The paper's two nodes, (lo.xyz, hi.x) (hi.yz, count, first) each; `first` of a leaf
//                       counts texels.
//   LAYOUT_INTERLEAVED  64 bytes. The bounds of both children by axis: (l.lo.x, l.hi.x, l.lo.y, l.hi.y), the same of
//                       the right child, (l.lo.z, l.hi.z, r.lo.z, r.hi.z), (left child, right child, 0, 0).
//   LAYOUT_CENTRED      64 bytes. As LAYOUT_INTERLEAVED, with centres in place of lo and half extents in place of hi.
//                       The half extents are rounded up, so that a box never loses a point.
//   LAYOUT_COMPACT      48 bytes. The centres with the children, (l.c.xyz, left child), (r.c.xyz, right child), then
//                       one word of half extents for each axis: the upper half of l.e's bits above the upper half of
//                       r.e's. Read as a float, the word is l.e with the bits of r.e as its last digits. Each half is
//                       rounded so that no point is lost.
#define PAIR_TEXELS(layout) ((layout) == LAYOUT_COMPACT ? 3u : 4u)

// The eight-wide tree (method packet-wide): a node has up to WIDE8_CHILDREN children of two texels each. (lo.xyz,
// child) lies at the node's first texel plus the child's number, (hi.xyz, 0) WIDE8_CHILDREN texels behind it. A child
// is the number of an eight-wide node, or a leaf as above; an unused place holds END_OF_TREE and an empty box. A stack
// entry is the node's number in 24 bits, above one bit for each child that is still to be visited.
#define WIDE8_CHILDREN 8
#define WIDE8_NODE_TEXELS 16
#define WIDE8_MAX_NODES 0xFFFFFF

// The four-wide tree (method bvh4): a node has up to BVH4_CHILDREN children and takes four texels. Boxes lie on a grid
// of the node's own. The node holds the grid's origin, the grid's step along each axis, and one byte a child, in steps,
// for each lower and each upper plane: (first.xyz, step.x), (lower x, y, z, step.y), (upper x, y, z, step.z). The last
// texel holds the children: the texel where a node starts, or a leaf as above, or END_OF_TREE where there is none.
#define BVH4_CHILDREN 4
#define BVH4_NODE_TEXELS 4

// The compressed eight-wide tree (method bvh8): a node has up to BVH8_CHILDREN children, each in a slot, and takes five
// texels, 80 bytes. Bits 0, 1 and 2 of a slot's number are set where its child lies towards larger x, y and z. Boxes
// lie on a grid of the node's own, a byte a plane, as in the four-wide tree:
//   (first.xyz, inner) (step.xyz, leaves)
//   (lower x of slots 0 to 3, of slots 4 to 7, upper x of slots 0 to 3, of slots 4 to 7), the same for y and for z
// inner and leaves have a bit for each slot with such a child, in the lowest byte. Above it inner has the number of the
// first inner child: the inner children of a node lie one behind the other in the order of their slots. leaves has the
// texel where the node's leaves are listed in the order of their slots, a word each, four to a texel, behind all nodes.
#define BVH8_CHILDREN 8
#define BVH8_NODE_TEXELS 5
#define BVH8_MAX_TEXELS 0xFFFFFF

// The frontier (method frontier): nodes near the root for each octant of directions (bit 0: down along x, 1: y, 2: z),
// two texels each, (lo.xyz, child reference), (hi.xyz, 0). Unused places hold END_OF_TREE and an empty box. With 32
// nodes an octant NVIDIA's compiler (580.159) made a kernel that lost any hits in mode plain.
#define FRONTIER_NODES 64
#define FRONTIER_OCTANTS 8

// Two levels (BALLOT_INSTANCES). The nodes, leaves and formats of all meshes lie one behind the other; child references
// count from the mesh's own first texel. The top-level tree lies in an array of its own: first its inner nodes,
// TOP_NODE_TEXELS each, (l.lo.xyz, left child) (l.hi.xyz, l.slack) (r.lo.xyz, right child) (r.hi.xyz, r.slack), then a
// record for each instance. A child is a node's texel, or LEAF_BIT above the number of an instance. The record of an
// instance is
//   (row i of the matrix of directions, translation along i)   for i = x, y, z
//   (box.lo.xyz, mesh) (box.hi.xyz, slack) (first, mirrors, 0, 0)     first: the number of its first triangle;
//   mirrors: 1 if the matrix mirrors
// The table of meshes has for each
//   (bounds.lo.xyz, padded_reach) (bounds.hi.xyz, shear_scale) (box_origin.xyz, shear_near) (root, first texels of its
//   nodes, its leaves and its format)
#define TOP_NODE_TEXELS 4
#define INSTANCE_TEXELS 6
#define MESH_TEXELS 4

#ifdef __cplusplus
}  // namespace ballot

#endif
#endif  // BALLOT_LAYOUT_H
