// Records, push constants and bindings of the kernels that pose vertices and move triangles (shaders/pose/,
// engine/tree/device/device_poser.h, engine/tree/device/posed_triangles.h).
#ifndef BALLOT_POSE_H
#define BALLOT_POSE_H

#include "layout.h"

#define POSE_GROUP 64  // invocations of a workgroup

// Bindings of set 0. Vertices, influences and deltas are those of engine/model/animation.h.
#define BIND_POSE_PARTS 0
#define BIND_POSE_PART_OF 1     // the part of each posed vertex
#define BIND_POSE_POSITIONS 2   // three floats a vertex; of pose/indexed.comp with any stride
#define BIND_POSE_NORMALS 3     // the same
#define BIND_POSE_INFLUENCES 4  // joint and weight
#define BIND_POSE_DELTAS 5      // position and normal, six floats
#define BIND_POSE_MATRICES 6    // 3 x 4, row by row
#define BIND_POSE_WEIGHTS 7
#define BIND_POSE_POSED 8  // position and normal, six floats
#define BIND_POSE_MOVED 9  // parts whose triangles move, deformed or as a whole
#define BIND_POSE_PLACES 10    // the place of each of these parts
#define BIND_POSE_PLACED 11    // position and normal of the vertices of parts that move as a whole
#define BIND_POSE_CORNERS 12   // three vertices of the mesh for each triangle
#define BIND_POSE_TRIANGLES 13  // the scene's triangles: nine floats
#define BIND_POSE_STATE 14
#define BIND_POSE_TRIANGLE_TEXELS 15  // of shading: BIND_TRIANGLES and BIND_NORMALS of render.h
#define BIND_POSE_NORMAL_TEXELS 16

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

// A part whose triangles move.
struct MovedPart {
  uint first_triangle;  // of the scene
  uint first_moved;     // the same, counted among the triangles that move
  uint first_corner;
  uint first_posed;  // its first vertex among those that are posed, or placed
  uint first_vertex;
  uint whole;   // 1: it moves as a whole, and its vertices are placed
  uint turned;  // 1: corners 1 and 2 change places, as its matrix mirrors
};

// Where a part lies: rows of the matrix from its mesh to the world, and rows of the matrix of its normals.
struct PartPlace {
  double world[12];
  double normal[9];
};

// The bounds of the triangles that have moved, as ordered() of lib/build/order.glsl, and the first vertex with a
// coordinate that leaves the range of scenes (POSE_NONE: none; pose/triangles.comp does not tell which). The largest
// extent of a triangle along each axis, and the first index of no vertex (POSE_NONE: none): of pose/indexed.comp.
#define POSE_NONE 0xFFFFFFFFu
struct PoseState {
  uint lo[3];
  uint hi[3];
  uint first_bad;
  uint largest[3];  // bits of float32
  uint first_bad_corner;
};

struct MovePush {
  uint items;  // vertices or triangles
  uint parts;
};

struct IndexedPush {
  uint items;     // triangles
  uint vertices;
  uint first_triangle;  // of the tree
  uint first_word;      // of the first vertex, from the beginning of what is bound
  uint stride_words;    // from one vertex to the next
};

#ifdef __cplusplus
}
#endif
#endif
