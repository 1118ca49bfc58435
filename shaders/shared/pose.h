// Records, push constants and bindings of the kernel that poses vertices (shaders/pose/, engine/tree/device_poser.h).
#ifndef BALLOT_POSE_H
#define BALLOT_POSE_H

#include "layout.h"

#define POSE_GROUP 64  // invocations of a workgroup

// Bindings of set 0. Vertices, influences and deltas are those of engine/scene/animation.h.
#define BIND_POSE_PARTS 0
#define BIND_POSE_PART_OF 1     // the part of each posed vertex
#define BIND_POSE_POSITIONS 2   // three floats a vertex
#define BIND_POSE_NORMALS 3     // the same
#define BIND_POSE_INFLUENCES 4  // joint and weight
#define BIND_POSE_DELTAS 5      // position and normal, six floats
#define BIND_POSE_MATRICES 6    // 3 x 4, row by row
#define BIND_POSE_WEIGHTS 7
#define BIND_POSE_POSED 8  // position and normal, six floats

#ifdef __cplusplus
namespace ballot {
using uint = std::uint32_t;
#endif

// A deformed part: its places in the arrays.
struct PosePart {
  uint first_posed;
  uint first_vertex;
  uint vertices;
  uint first_influence;
  uint influences;  // of each vertex; 0: the part has one matrix
  uint first_delta;
  uint targets;
  uint first_matrix;
  uint first_weight;
};

struct PosePush {
  uint vertices;  // posed
};

#ifdef __cplusplus
}
#endif
#endif
