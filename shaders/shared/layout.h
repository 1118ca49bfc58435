// Records that C++ and GLSL share. Only float, uint and vec3 under scalar layout, so no padding rule has to be
// remembered; the sizes are asserted in C++, and a test writes each record on the device and compares the bytes.
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

// A hit is searched for t in [t_min, t_max]; t counts multiples of dir, which need not be of unit length.
// A ray with t_max <= t_min, or with a NaN or an infinite component, is dead: it is reported as a miss.
struct Ray {
  vec3 origin;  // scene units
  float t_min;
  vec3 dir;
  float t_max;
};
BALLOT_RECORD(Ray, 32);

// prim numbers the triangle as the scene file does; NO_HIT on a miss. u and v weigh the vertices 1 and 2.
struct Hit {
  float t;
  uint prim;
  float u;
  float v;
};
BALLOT_RECORD(Hit, 16);

// Vinkler, Traversal methods for GPU ray tracing, section 2, figure 1. Siblings are neighbours: the right child is node
// first + 1, and a pair starts at an even index and fills 64 bytes. The paper promotes count and first to float; here
// they stay integers, which are exact beyond 2^24.
struct BvhNode {
  vec3 lo;     // scene units
  vec3 hi;     // hi >= lo on each axis
  uint count;  // leaf: 1..MAX_LEAF_TRIANGLES references. Inner node: 0
  uint first;  // leaf: index of its first reference. Inner node: index of its left child
};
BALLOT_RECORD(BvhNode, 32);

#define NO_HIT 0xFFFFFFFFu

// A dispatch that the device calls: what it reads itself, and the kernel's part.
struct IndirectArgs {
  uint groups_x, groups_y, groups_z;
  uint count;  // rays, from the first of the buffer on
};
BALLOT_RECORD(IndirectArgs, 16);

// Bindings of set 0 that all kernels share.
#define BIND_RAYS 0
#define BIND_HITS 1

// A child reference in a device layout is one word: an inner node is the texel (16 bytes) at which the pair of its
// children starts; a leaf has the top bit set, then its count - 1 in three bits, then the texel at which its block
// starts in the leaf array. END is what lies at the bottom of every stack.
#define LEAF_BIT 0x80000000u
#define LEAF_COUNT_SHIFT 28
#define LEAF_TEXEL_MASK 0x0FFFFFFFu
#define END_OF_TREE 0xFFFFFFFFu
#define MAX_LEAF_TRIANGLES 6

// Boxes of nodes and leaves, in every tree, are measured from zero, or along axes on which the scene is far from it from the middle
// of the scene (box_origin(), engine/bvh/bvh.h); vertices are as they are.

// A leaf block: two texels of the leaf's own box, (lo.xyz, count), (hi.xyz, x), then three texels a triangle, in a format
// that the triangle test asks for.
//   LEAVES_VERTICES  by coordinate, so that a test reads them in the order that suits its ray: (v0.x, v1.x, v2.x, prim), the
//                    same of y and of z; x = 0
//   LEAVES_AFFINE    the rows z, x, y of the affine map that takes v0, v1, v2 to (0,0,0), (1,0,0), (0,1,0), all zero for a
//                    degenerate triangle; x is the texel where the block's prims begin, four a texel, behind all blocks
#define LEAVES_VERTICES 0
#define LEAVES_AFFINE 1
#define LEAF_HEADER_TEXELS 2
#define TRIANGLE_TEXELS 3

// How a pair lies on the device, in PAIR_TEXELS texels. 64 bytes: the paper's two nodes, (lo.xyz, hi.x) (hi.yz, count, first) each,
// where `first` of a leaf counts texels; or both children's bounds by axis, (l.lo.x, l.hi.x, l.lo.y, l.hi.y), the same of the
// right child, (l.lo.z, l.hi.z, r.lo.z, r.hi.z), (left child, right child, 0, 0); or the same with centres in the place of lo and
// half extents in the place of hi, rounded up so that a box never loses a point. 48 bytes: centres with the child, (l.c.xyz, left
// child), (r.c.xyz, right child), and a word an axis of half extents: the upper half of l.e's bits above the upper half of r.e's.
// Read as a float, the word is l.e with what follows for its last digits; each half is rounded so that no point is lost.
#define PAIR_TEXELS(layout) ((layout) == LAYOUT_COMPACT ? 3u : 4u)

// The wide tree: up to WIDE8_CHILDREN children a node, each two texels, (lo.xyz, child) at the node's first texel plus the
// child's number, (hi.xyz, 0) WIDE8_CHILDREN texels behind. A child is a wide node by number or a leaf as above; END_OF_TREE and
// an empty box where there is none. A stack entry is the node's number in 24 bits above a bit for each child still to be met.
#define WIDE8_CHILDREN 8
#define WIDE8_NODE_TEXELS 16
#define WIDE8_MAX_NODES 0xFFFFFF

// The quad tree: up to BVH4_CHILDREN children a node, which takes four texels: where its grid begins and the grid's step along
// each axis, with a byte a child, in steps, of the lower and the upper planes, (first.xyz, step.x), (lower x, y, z, step.y),
// (upper x, y, z, step.z), then the children: the texel where a node starts, or a leaf as above; END_OF_TREE where there is none.
#define BVH4_CHILDREN 4
#define BVH4_NODE_TEXELS 4

// The frontier: 32 or 64 nodes for each octant of directions (bit 0: down along x, 1: y, 2: z), each two texels, (lo.xyz, child
// reference), (hi.xyz, 0); END_OF_TREE and an empty box where there are fewer.
#define FRONTIER_OCTANTS 8

#ifdef __cplusplus
}  // namespace ballot

#endif
#endif  // BALLOT_LAYOUT_H
