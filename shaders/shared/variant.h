// The specialization constants, bindings and preprocessor defines of a traversal kernel variant. Every variant must
// give all of the defines. Only engine/answer/variant.cpp sets them.
#ifndef BALLOT_VARIANT_H
#define BALLOT_VARIANT_H

#include "layout.h"
#include "knobs.h"

// Specialization constants.
#define SPEC_GROUP_SIZE 0       // invocations in a workgroup
#define SPEC_STACK_SIZE 1       // entries of a depth-first stack, including the sentinel
#define SPEC_GROUP_SUBGROUPS 2  // subgroups in a workgroup at the smallest subgroup size that the pipeline may get
#define SPEC_SUBGROUP_SIZE 3    // invocations in a subgroup; sizes the stack that is spread over lanes
#define SPEC_LIST_SIZE 4        // nodes that a ray can set aside, below its own stack; 0 for methods without lists
#define SPEC_TOP_STACK 5        // BALLOT_INSTANCES only: entries of a ray's stack in the top-level tree

// Bindings of set 0, in addition to BIND_RAYS and BIND_HITS.
#define BIND_WORK 2
#define BIND_NODES 3
#define BIND_LEAVES 4
#define BIND_STATS 5     // instrumented variant only
#define BIND_FORMAT 6       // the second tree: eight-wide tree, four-wide tree or frontier (lib/tree/format.glsl)
#define BIND_INDIRECT 7  // kernels of indirect dispatches
#define BIND_TOP 8       // BALLOT_INSTANCES only: the top-level tree and its instances (lib/tree/instances.glsl)
#define BIND_MESHES 9    // BALLOT_INSTANCES only: a record for each mesh
#define BIND_DOUBTFUL 10 // kernels that list or take rays in doubt: IndirectArgs, then the numbers of the rays
#define BIND_DOUBLES 60  // BALLOT_DOUBLES only: corners of triangles (engine/tree/device/double_corners.h)
#define BIND_PUSHED 61   // calls in a program's own shader: the push constants of other kernels

// Defines that knobs set have their values in knobs.h, written from engine/answer/knobs.h. The others:
//
// BALLOT_ANY_HIT           1: any hit ends a ray. 0: the nearest hit is searched for. Kernels of users
//                          (lib/called/scene.glsl) may do either:
#define ANY_HIT_ASKED 2     // `takes_any` tells
// BALLOT_INDIRECT          1: the ray count is read from BIND_INDIRECT, entry push.ray_end.
// BALLOT_CAMERA            1: the kernel generates the rays of camera push.camera of BIND_CAMERAS
//                          (lib/camera/camera_samples.glsl) instead of reading rays; its kind: lib/camera/camera.glsl.
// BALLOT_RAY_TEXELS        1: rays are read through a texel buffer; on CPU devices every storage buffer is one.
// BALLOT_SUBGROUP_BARRIER  1: subgroupBarrier() orders shared memory within a subgroup. 0: a memory barrier alone, for
//                          drivers that run subgroupBarrier() as a barrier of the workgroup.
// BALLOT_LEAF_LOOP         1: leaves hold up to six triangles. 0: every leaf holds one, and methods other than
//                          packet-wide have no loop over them.
// BALLOT_BOX_ORIGIN        1: boxes are measured from push.box_origin. 0: from zero.
// BALLOT_INSTANCES         1: two levels, the trees of meshes below a tree of instances (lib/tree/instances.glsl).
//                          0: one tree.
// BALLOT_SHAPES            a bit for each kind of shape that the meshes of instances have (shapes.h). 0: triangles
//                          alone.
// BALLOT_LOOPS_CUT         1: the driver may end loops early, so kernels check that theirs ran to the end
//                          (lib/frame/cut_loops.glsl).
// BALLOT_UNIFORM_FLOW      1: the device has subgroup-uniform control flow.
// BALLOT_DOUBLES           1: triangle test "double" reads vertices of BIND_DOUBLES. 0: those of leaves.
// BALLOT_RAYS_DOUBLE       1: rays are records of doubles (lib/numeric/in_double.glsl). 0: of float32.
// BALLOT_COUNTERS          1: the instrumented variant, which writes RayStats.
// BALLOT_DOUBTFUL          what becomes of rays whose hit is open after float32 and double (lib/frame/doubtful.glsl):
#define DOUBTFUL_DECIDED 0  // they are decided at once; also where no ray is left open
#define DOUBTFUL_LIMITED 1  // they are decided at once, but for rays with many decisions, which are listed
#define DOUBTFUL_LISTED 2   // they are listed
#define DOUBTFUL_TAKEN 3    // rays are taken from that list, and decided
//
// BALLOT_TRIANGLE and BALLOT_BOX: what a numeric mode is made of; see lib/numeric/numeric.glsl.
#define TRIANGLE_MOELLER 0
#define TRIANGLE_WOOP_AFFINE 1
#define TRIANGLE_WATERTIGHT 2
#define TRIANGLE_EXACT 3
#define TRIANGLE_DOUBLE 4
#define BOX_SLABS 0
#define BOX_FMA 1
#define BOX_PADDED 2
#define BOX_WIDENED 3
#define BOX_RELATIVE 4

// Hit::prim of a ray whose traversal the driver cut short (see lib/frame/cut_loops.glsl). It never leaves the tracer.
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
  uint format_lo, format_hi;
  vec3 box_origin;                // BALLOT_BOX_ORIGIN only: the point that boxes are measured from (layout.h)
  float padded_reach;             // BOX_WIDENED: the largest distance, along an axis, of a ray origin from that point
  float shear_scale, shear_near;  // TRIANGLE_WATERTIGHT; see engine/tree/device/shear.h
  uint threshold;                 // for methods that have one: lanes, entries or disagreements (methods.h)
  uint camera;                    // BALLOT_CAMERA only: entry of BIND_CAMERAS
};

// Push constants of a kernel for instances, behind TracePush. There push.root is the top-level tree's root, and what
// push says about the scene, its boxes and its addresses holds for the arrays of all meshes.
struct TopPush {
  uint top_lo, top_hi;  // buffer addresses, FETCH_REFERENCE only
  uint meshes_lo, meshes_hi;
  uint records;    // texel of BIND_TOP at which the records of the instances begin
  uint mesh_root;  // child reference at which the walk of each mesh's tree starts; END_OF_TREE: its root
};

// The work buffer. `next` counts up from ray_begin; a subgroup takes as many rays as it has lanes, or idle lanes.
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
BALLOT_RECORD(TopPush, 24);
BALLOT_RECORD(Work, 8);
BALLOT_RECORD(RayStats, 72);
}  // namespace ballot
#endif

#ifndef __cplusplus
#include "knobs_guard.h"
#endif

#endif  // BALLOT_VARIANT_H
