// Written by `ballot shaders --headers` from the registry engine/answer/knobs.h; a test compares.
// The values of the defines that knobs set.
#ifndef BALLOT_KNOBS_H
#define BALLOT_KNOBS_H

// BALLOT_FETCH: how nodes and triangles are read: storage buffers, texel buffers, or buffer device addresses.
#define FETCH_STORAGE 0
#define FETCH_TEXEL 1
#define FETCH_REFERENCE 2

// BALLOT_LAYOUT: how the two boxes of a node pair lie in its 64 bytes (compact: 48).
#define LAYOUT_PAPER 0
#define LAYOUT_INTERLEAVED 1
#define LAYOUT_CENTRED 2
#define LAYOUT_COMPACT 3

// BALLOT_VOTE: packets: how the lanes agree on the order of two children.
#define VOTE_ANY 0
#define VOTE_COUNT 1
#define VOTE_SUM 2

// BALLOT_PACKET_STACK: packets: the shared stack lies in shared memory, or in registers spread over the lanes.
#define PACKET_STACK_SHARED 0
#define PACKET_STACK_LANES 1

// BALLOT_COOPERATIVE: packets: four lanes load a node pair and pass it to the others.

// BALLOT_RAYS: packet-wide: rays per lane.

// BALLOT_FALLBACK: packet-wide: packets that spread over more than two octants, or meet every box, are traced ray by ray.

// BALLOT_JUMP: packet-wide: rays that miss a leaf's box branch around its triangles (1) or are masked (0).

// BALLOT_REDUCE: frontier: minima over the lanes are found by shuffles, or by integer reductions.
#define REDUCE_SHUFFLE 0
#define REDUCE_INTEGER 1

// BALLOT_STACK: traversal ray by ray: where a ray's own stack lies.
#define STACK_PRIVATE 0
#define STACK_SHARED 1

// BALLOT_PUSH: traversal ray by ray: the far child is stored where needed (branch), or in every step.
#define PUSH_BRANCH 0
#define PUSH_ALWAYS 1

// BALLOT_PRODUCTS: watertight: how the exact sign of an edge function is found; fma is wrong where fma() rounds twice.
#define PRODUCTS_SPLIT 0
#define PRODUCTS_FLOAT64 1
#define PRODUCTS_FMA 2

// BALLOT_MINMAX: box test: minima and maxima by built-in functions, by comparison, or of three integers at once.
#define MINMAX_BUILTIN 0
#define MINMAX_SELECT 1
#define MINMAX_INTEGER 2

// BALLOT_UNPACK: bvh8: the bytes of boxes become floats as digits of halves, or as integers.
#define UNPACK_HALF 0
#define UNPACK_INTEGER 1

// BALLOT_LEAF_BOX: the box of a leaf is tested again before its triangles.

// BALLOT_LEAF_RUN: traversal ray by ray: leaves are tested until a node comes up (1), or one at a time (0).

// BALLOT_SORTED: any hit, traversal ray by ray: the nearer child is entered first (1), or the left one (0).

// BALLOT_LAUNCH: one invocation per ray, or resident subgroups that take batches of rays from a counter.
#define LAUNCH_PLAIN 0
#define LAUNCH_PERSISTENT 1

// BALLOT_CLAIM: persistent launch, idle lanes take new rays: the most claimed at once; 1: one for each idle lane.

#endif  // BALLOT_KNOBS_H
