// Push constants and bindings of the kernels that reorder rays (shaders/reorder/, engine/answer/reorder.h).
#ifndef BALLOT_REORDER_H
#define BALLOT_REORDER_H

#include "layout.h"

#define REORDER_GROUP 128       // invocations of a workgroup
#define REORDER_KEY_BITS 24     // of a key: a pass of the sort for each eight
#define REORDER_STATS_WORDS 18  // of RayStats (variant.h)

// Bindings of set 0, in addition to BIND_RAYS and BIND_HITS (layout.h), which are read.
#define BIND_REORDER_KEYS 2   // out: a word a ray
#define BIND_REORDER_ORDER 3  // in: the number of the ray at each place
#define BIND_REORDER_RAYS 4   // out: rays in their order
#define BIND_REORDER_HITS 5   // out: hits at the places of their rays
#define BIND_REORDER_STATS 6  // in: records of counters, in order
#define BIND_REORDER_STATS_OUT 7
#define BIND_REORDER_ARGS 8  // in: indirect arguments that count the rays

#ifdef __cplusplus
namespace ballot {
#endif

struct ReorderPush {
  uint first;  // ray of the caller's buffer
  uint count;  // rays; with BALLOT_INDIRECT: their number at most
  uint args;   // with BALLOT_INDIRECT: which indirect arguments
  vec3 lo;     // bounds of the scene
  vec3 hi;
};

#ifdef __cplusplus
BALLOT_RECORD(ReorderPush, 36);
}  // namespace ballot
#endif

#endif  // BALLOT_REORDER_H
