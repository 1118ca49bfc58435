// The specialization constants, bindings and preprocessor defines of a traversal kernel variant. Every variant must
// give all of the defines. Only engine/trace/variant.cpp sets them.
#ifndef BALLOT_VARIANT_H
#define BALLOT_VARIANT_H

#include "layout.h"
#include "products.h"

// Specialization constants.
#define SPEC_GROUP_SIZE 0       // invocations in a workgroup
#define SPEC_STACK_SIZE 1       // entries of a depth-first stack, including the sentinel
#define SPEC_GROUP_SUBGROUPS 2  // subgroups in a workgroup at the smallest subgroup size that the pipeline may get
#define SPEC_SUBGROUP_SIZE 3    // invocations in a subgroup; sizes the stack that is spread over lanes
#define SPEC_LIST_SIZE 4        // nodes that a ray can set aside, below its own stack; 0 for methods without lists

// Bindings of set 0, in addition to BIND_RAYS and BIND_HITS.
#define BIND_WORK 2
#define BIND_NODES 3
#define BIND_LEAVES 4
#define BIND_STATS 5     // instrumented variant only
#define BIND_TOP 6       // the second tree: wide tree, four-wide tree or frontier (lib/tree/second_tree.glsl)
#define BIND_INDIRECT 7  // kernels of indirect dispatches

// BALLOT_INDIRECT: 1: how many rays there are stands in BIND_INDIRECT, at entry push.ray_end, as the device has counted them.

// BALLOT_CAMERA: 1: rays are not read but made, those of camera push.camera of BIND_CAMERAS (lib/camera/camera_samples.glsl), by kernels
// that are told its kind: lib/camera/camera.glsl.

// BALLOT_FETCH: how nodes and leaves are read.
#define FETCH_STORAGE 0    // storage buffer
#define FETCH_TEXEL 1      // texel buffer, R32G32B32A32_UINT
#define FETCH_REFERENCE 2  // buffer device address

// BALLOT_RAY_TEXELS: 1: rays are read through a texel buffer too; every storage buffer of a CPU device can be one.

// BALLOT_STACK: where a ray's own stack lies.
#define STACK_PRIVATE 0
#define STACK_SHARED 1

// BALLOT_PUSH: how a ray's own stack is written.
#define PUSH_BRANCH 0  // where there is something to keep
#define PUSH_ALWAYS 1  // in every step; the top of the stack moves only where there is something to keep

// BALLOT_PACKET_STACK: where the stack of a packet lies.
#define PACKET_STACK_SHARED 0
#define PACKET_STACK_LANES 1  // spread over the registers of the lanes, read by shuffle

// BALLOT_VOTE: how the lanes of a packet agree.
#define VOTE_ANY 0    // subgroupAny: which children anybody wants; whether anybody wants the left one first
#define VOTE_COUNT 1  // ballot and bit count: the majority goes first
#define VOTE_SUM 2    // the same majority by a reduction in shared memory, as hardware of 2010 had to

// BALLOT_MINMAX: how the box test takes minima and maxima.
#define MINMAX_BUILTIN 0
#define MINMAX_SELECT 1   // by comparison and selection
#define MINMAX_INTEGER 2  // of three axes at once, by their bits

// BALLOT_JUMP: 1: code that no lane wants is put under a branch, which the device jumps over; 0: lanes are masked. Loops are made
// for that, too.

// BALLOT_REDUCE: how minima over lanes are found.
#define REDUCE_SHUFFLE 0
#define REDUCE_INTEGER 1  // of integers, by the device's own instruction

// BALLOT_FRONTIER: nodes of the frontier, 32 or 64.

// BALLOT_LEAF_LOOP: 0: every leaf holds one triangle, and walks other than packet-wide have no loop over them; 1: up to six.

// BALLOT_BOX_ORIGIN: 1: boxes are measured from push.box_origin; 0: from zero.

// BALLOT_LAUNCH: how work reaches subgroups.
#define LAUNCH_PLAIN 0       // one ray an invocation, the device schedules
#define LAUNCH_PERSISTENT 1  // subgroups take batches from a counter until none is left (Aila and Laine 2009)

// BALLOT_TRIANGLE and BALLOT_BOX: what a numeric mode is made of; see lib/numeric/numeric.glsl.
#define TRIANGLE_MOELLER 0
#define TRIANGLE_WOOP_AFFINE 1
#define TRIANGLE_WATERTIGHT 2
#define TRIANGLE_EXACT 3
#define BOX_SLABS 0
#define BOX_FMA 1
#define BOX_PADDED 2
#define BOX_WIDENED 3

// Hit::prim of a ray whose traversal the driver cut short (see lib/frame/main.glsl). It never leaves the tracer.
#define UNFINISHED 0xFFFFFFFEu

#ifdef __cplusplus
namespace ballot {
#endif
// Push constants of every traversal kernel.
struct TracePush {
  vec3 scene_lo;  // bounds of the whole scene, whatever the root; they size the padding of boxes
  uint root;      // child reference at which traversal starts
  vec3 scene_hi;
  uint ray_end;  // traces rays [ray_begin, ray_end); BALLOT_INDIRECT: entry with the count
  uint ray_begin;
  uint max_batches;         // persistent launch: the most batches that a subgroup takes
  uint nodes_lo, nodes_hi;  // buffer addresses, FETCH_REFERENCE only
  uint leaves_lo, leaves_hi;
  uint top_lo, top_hi;
  vec3 box_origin;                // BALLOT_BOX_ORIGIN only: the point that boxes are measured from (layout.h)
  float padded_reach;             // BOX_WIDENED: the largest distance, along an axis, of a ray origin from that point
  float shear_scale, shear_near;  // TRIANGLE_WATERTIGHT; see engine/trace/shear.h
  uint threshold;                 // for methods that have one: lanes, entries or disagreements (engine/trace/methods.h)
  uint camera;                    // BALLOT_CAMERA only: entry of BIND_CAMERAS
};

// The work buffer. `next` counts up from ray_begin; a subgroup takes rays in steps of its own size.
struct Work {
  uint next;
  uint unfinished;  // rays whose traversal was cut short
};

// The counters of the instrumented variant, one record a ray. A lane visits a node or leaf if its subgroup walks it
// while the lane's ray is alive. The lane needs the node if its own ray met the box when the node was entered or
// pushed, as a ray that is traced alone would. An event that happens once for a subgroup is counted in the record of
// one of its rays, so only sums over all rays have a meaning.
struct RayStats {
  uint nodes, nodes_needed;  // inner nodes, counted as pairs of children
  uint leaves, leaves_needed;
  uint triangles, triangles_tested;  // triangles in visited leaves; those that the ray was tested against
  uint packet_nodes;                 // nodes visited on a path that the subgroup shares
  uint lanes;                        // sum over visits of the lanes that needed the visit
  uint steps;                        // once a subgroup: node and leaf visits
  uint unneeded, few;                // once a subgroup: shared node visits in which no lane could still find a nearer
                                     // hit; those in which some lanes could, but fewer than a quarter
  uint votes, disagreements;         // once a subgroup: rounds of voting; those in which lanes wanted different
                                     // children first
  uint switches, switch_depth;       // once a subgroup: nodes at which shared traversal became per-ray traversal; the
                                     // sum of their depths
  uint overflows;                    // once a subgroup: pairs of children that a packet kept because a list was full
  uint stack;                        // high-water mark of the shared stack, or of the ray's own stack with its list
  uint fetches;                      // rays taken by an idle lane while other lanes were at work
};

#ifdef __cplusplus
BALLOT_RECORD(TracePush, 96);
BALLOT_RECORD(Work, 8);
BALLOT_RECORD(RayStats, 72);
}  // namespace ballot
#endif

#ifndef __cplusplus
#if !defined(BALLOT_FETCH) || !defined(BALLOT_STACK) || !defined(BALLOT_PACKET_STACK) || !defined(BALLOT_VOTE) || \
    !defined(BALLOT_LAUNCH) || !defined(BALLOT_TRIANGLE) || !defined(BALLOT_BOX) || !defined(BALLOT_PRODUCTS) || !defined(BALLOT_ANY_HIT) || !defined(BALLOT_LAYOUT) || \
    !defined(BALLOT_SUBGROUP_BARRIER) || !defined(BALLOT_COOPERATIVE) || !defined(BALLOT_UNIFORM_FLOW) || \
    !defined(BALLOT_MINMAX) || !defined(BALLOT_LEAF_BOX) || !defined(BALLOT_SORTED) || !defined(BALLOT_COUNTERS) || !defined(BALLOT_LOOPS_CUT) || !defined(BALLOT_LEAF_RUN) || !defined(BALLOT_PUSH) || !defined(BALLOT_RAYS) || !defined(BALLOT_FALLBACK) || \
    !defined(BALLOT_LEAF_LOOP) || !defined(BALLOT_BOX_ORIGIN) || !defined(BALLOT_REDUCE) || !defined(BALLOT_FRONTIER) || !defined(BALLOT_JUMP) || !defined(BALLOT_INDIRECT) || !defined(BALLOT_CAMERA)
#error a traversal variant must give every BALLOT_ define (engine/trace/variant.cpp)
#endif
#endif

#endif  // BALLOT_VARIANT_H
