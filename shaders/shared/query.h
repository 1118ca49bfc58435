// Records and bindings that C++ and GLSL share for the queries of shaders/query/: points and crossings.
#ifndef BALLOT_QUERY_H
#define BALLOT_QUERY_H

#include "layout.h"

// The bindings of set 0 that query kernels have in addition to those of layout.h and variant.h.
#define BIND_CROSSINGS 16       // out: a word for each query: crossings of a ray, or whether a point is inside
#define BIND_PLACES 17          // in: where lists go
#define BIND_TRIANGLE_MASKS 19  // in: a word a triangle
#define BIND_TILES 20           // sums of tiles of queries (shaders/query/places.comp)
#define BIND_PSEUDONORMALS 21   // in: PSEUDONORMALS vectors of each triangle
#define BIND_POINT_INSTANCES 23  // in: the instances as closest points need them
#define BIND_RECORDS 24         // out: the records of lists
#define BIND_ROWS 25            // in: the same in rows
#define BIND_OFFSETS 26         // out: where lists begin among all
#define BIND_APPENDED 27        // AppendedLists
#define BIND_MADE_HOW 29        // in: how questions are made of tables
#define BIND_MADE_WORDS 30      // in: the tables
#define BIND_WHOLE_PLACES 28    // in: where lists lie whole
#define BIND_QUESTION_WORDS 51  // in: a word a question for the first filter; those of the others follow
#define BIND_GROUPS 54          // in: where groups of instances lie

// shaders/query/neighbours.comp, and the order in which closest_point.comp takes points.
#define BIND_NEIGHBOUR_STATE 31  // NeighbourState
#define BIND_ORDER_NEAR 32       // the numbers of points, those of each tile put in order
#define BIND_ORDER_SORTED 33     // the same of all points, from 0 on
#define BIND_NEIGHBOUR_KEYS 34   // a word a point
#define BIND_SORTED 35           // IndirectArgs, whose count is that of the points if all are sorted, else 0

// shaders/query/cells.comp, look_up.comp, and the points that inside.comp takes.
#define BIND_CELL_GRID 36      // in: CellGrid
#define BIND_CELLS 37          // two bits a cell, in order of Morton codes
#define BIND_PARENT_CELLS 38   // in: the same of the level above
#define BIND_SHADOWS 39        // in: of each level a float for each row of cells
#define BIND_LISTED_POINTS 40  // the numbers of the points whose cells are touched
#define BIND_LISTED_COUNT 41   // how many they are

// shaders/query/winding.comp: a header (beta^2, 0, 0, 0), then MOMENT_TEXELS for each child of each pair, in order:
//   (centre, radius) (D, T xyz) (Q xx, yy, zz, T xxy) (Q yz, zx, xy, T xxz) (T yyx, yyz, zzx, zzy)
#define BIND_NODE_MOMENTS 42
#define MOMENT_TEXELS 5

// shaders/query/columns.comp, surfaces.comp and values.comp.
#define BIND_PRIM_TABLE 26    // in: placements and ids of triangles (engine/answer/columns.h)
#define BIND_CORNERS 27       // in: the corners of the triangles of all trees
#define BIND_CORNER_TABLE 28  // in: of each instance of a tree its first triangle, then where its corners are
#define BIND_COLUMNS 48       // out: the first of the columns
#define BIND_VALUE_TABLE 29    // in: where the values of an attribute are (engine/answer/attributes.h)
#define BIND_VALUES 30         // in: the values of an attribute, those of all meshes
#define BIND_VALUE_CORNERS 31  // in: the vertices of triangles, those of meshes with values of vertices

// shaders/query/sums.comp, beside BIND_PRIM_TABLE.
#define BIND_SUMS 48       // out: two words each
#define BIND_SUM_RANGE 49  // SumRange
#define BIND_WEIGHTS 50    // in: a word a ray, or one for all

// Kernels of users (lib/called/scene.glsl): their numbers, the first prim and the number of each instance in ascending
// order, and the first of their arrays.
#define BIND_USER_NUMBERS 62
#define BIND_USER_PLACES 63
#define BIND_USER_ARRAYS 64

// The parts of a triangle: corners 0, 1, 2, edges 0 1, 1 2, 2 0, and the inside. All but the inside have a pseudonormal
// (engine/tree/host/pseudonormals.h), in this order.
#define PART_EDGE 3u
#define PART_INSIDE 6u
#define PSEUDONORMALS 6u

// BIND_POINT_INSTANCES (lib/query/point_instances.glsl, whose letters these are). A header, the largest widening of a
// box for the rounding of corners of an instance, (widening, 0, 0, 0), then for each instance
//   (row i of M, t_i) for i = x, y, z            (row i of Q, b_i) for i = x, y, z
//   (T_xx, T_xy, T_xz, T_yy) (T_yz, T_zz, widening of its nodes' boxes, 0)
#define POINT_HEADER_TEXELS 1
#define POINT_TEXELS 8

// Filters of questions. BALLOT_FILTERS has the bits of those that leave something out. Each compares a word of the
// question:
#define FILTER_MASK 0      // a triangle is left out whose mask shares no bit with it
#define FILTER_EXCLUDED 1  // the triangle is left out whose number it is
#define FILTER_GROUP 2     // an instance is left out that is of another group, and not of GROUP_SHARED
#define FILTERS 3
#define GROUP_SHARED 0xFFFFFFFFu

// The words of BIND_GROUPS: the number of groups but for GROUP_SHARED; the root of the tree over the shared instances;
// the groups in ascending order; the root of each. A root is END_OF_TREE without instances.

// Specialization constant, in addition to those of variant.h: the crossings of a ray that
// shaders/query/crossings.comp keeps (lib/query/first.glsl).
#define SPEC_FIRST 6

// Specialization constant of kernels that list (lib/query/listing.glsl): the records of a row.
#define SPEC_ROW 7

// The values of BALLOT_LISTS: numbers alone, or lists, in rows or one after the other.
#define LISTS_NONE 0
#define LISTS_ROWS 1
#define LISTS_PLACES 2

// A longer list is put in order by a whole workgroup, or takes no place: the host makes it apart.
#define LONGEST_LIST 512u

// The values of BALLOT_CULL: what is left out.
#define CULL_NONE 0
#define CULL_BACK 1
#define CULL_FRONT 2

// shaders/query/order.comp: the lanes of a workgroup, and the dispatches.
#define ORDER_GROUP 128u
#define ORDER_LISTS 0u
#define ORDER_CARRY 1u

// shaders/query/pick.comp, by workgroups as order.comp: the dispatches.
#define PICK_COUNTS 0u  // cuts the numbers of records
#define PICK_LISTS 1u
#define PICK_ROWS 2u

// shaders/query/places.comp: the lanes of a workgroup, the queries of a lane and of a tile, and the dispatches.
#define PLACES_GROUP 128u
#define PLACES_SHARE 16u
#define PLACES_TILE (PLACES_GROUP * PLACES_SHARE)
#define PLACES_TILES 0u  // sums each tile
#define PLACES_SUM 1u    // sums the tiles
#define PLACES_PLACE 2u
// The values of BALLOT_PLACES: lists alone, lists behind others, hits without those that are none.
#define PLACES_LISTS 0
#define PLACES_APPENDED 1
#define PLACES_HITS 2

// shaders/query/columns.comp: the lanes of a workgroup, and the columns of an answer, whose bits BALLOT_COLUMNS has and
// whose bindings follow BIND_COLUMNS.
#define COLUMNS_GROUP 128u
#define COLUMN_DISTANCES 0   // float: of hits t
#define COLUMN_PRIMS 1       // uint: the triangle within its mesh
#define COLUMN_IDS 2         // uint
#define COLUMN_UVS 3         // 2 float
#define COLUMN_NORMALS 4     // 3 float
#define COLUMN_FLAGS 5       // byte: of hits whether there is one, of points whether they are inside
#define COLUMN_FLAG_WORDS 6  // uint: the same
#define COLUMN_INSTANCES 7   // uint
#define COLUMN_POINTS 8      // 3 float: the nearest point
#define COLUMN_SIGNED 9      // float: distances, negative inside
#define COLUMN_POSITIONS 10  // 3 float; this and those below of hits alone
#define COLUMN_FRONT 11      // byte: whether a ray meets the front
#define COLUMN_FRONT_WORDS 12  // uint: the same
#define COLUMNS 13
// Those of shaders/query/surfaces.comp follow.
#define COLUMN_MATERIALS 13        // uint
#define COLUMN_COLORS 14           // 4 float
#define COLUMN_SHADING_NORMALS 15  // 3 float; in: the normals of the triangles
#define ALL_COLUMNS 16

// The words of BIND_PRIM_TABLE: for each placement its first triangle, of all; their numbers; their ids; and what is
// added to a triangle's number for the ranges, which follow if ids are theirs: their first triangles, then their ids.
#define PLACEMENT_WORDS 4u
// The words of BIND_CORNER_TABLE: for each instance its first triangle, of all; then for each where the triangles of
// its tree begin in BIND_CORNERS, NO_HIT for shapes, and the rows of its matrix, with the translation.
#define CORNER_WORDS 14u

// The words of BIND_VALUE_TABLE: for each placement its first triangle, of all; then its mesh; then for each attribute
// and mesh VALUE_WORDS: VALUES_..., where its values begin in BIND_VALUES, and where its corners begin in
// BIND_VALUE_CORNERS, NO_HIT if vertices come in turn.
#define VALUE_WORDS 3u
#define VALUES_NONE 0u
#define VALUES_OF_VERTICES 1u     // interpolated
#define VALUES_OF_NEAR_VERTEX 2u  // the vertex of the largest weight
#define VALUES_OF_PRIMS 3u
#define VALUES_OF_MESH 4u

// shaders/query/sums.comp: the lanes of a workgroup, the values of BALLOT_SUMS, and the dispatches.
#define SUMS_GROUP 128u
#define SUMS_PRIMS 0
#define SUMS_INSTANCES 1
#define SUMS_MESHES 2
#define SUMS_RANGE 0u  // finds the largest weight
#define SUMS_ADD 1u
#define SUMS_END 2u    // makes numbers of the sums

// shaders/query/made.comp: the lanes of a workgroup, the values of BALLOT_MADE, the most axes of questions, and of
// their columns: x, y, z, limit of points; origin, t_min, direction, t_max, pose of rays.
#define MADE_GROUP 128u
#define MADE_POINTS 0
#define MADE_RAYS 1
#define MADE_POSED_RAYS 2  // a pose moves each
#define MADE_AXES 8
#define MADE_COLUMNS 5

// shaders/query/neighbours.comp: the lanes of a workgroup, the points of a tile, the bits of a key, a pass of the sort
// for each eight, how many times as far apart as when they are sorted neighbours are if sorting pays, and the
// dispatches.
#define NEIGHBOURS_GROUP 128u
#define NEIGHBOURS_TILE 2048u
#define NEIGHBOURS_KEY_BITS 24u
#define NEIGHBOURS_PAYS 4.0
#define NEIGHBOURS_SAMPLE 0u
#define NEIGHBOURS_DECIDE 1u
#define NEIGHBOURS_TILES 2u
#define NEIGHBOURS_KEYS 3u

// shaders/query/look_up.comp: the lanes of a workgroup. What a cell is; a cell of none but touched ones is one of them.
#define LOOK_UP_GROUP 128u
#define CELL_OUTSIDE 0u
#define CELL_INSIDE 1u
#define CELL_TOUCHED 2u
// The first level of cells has no parents; level k has 2^k cells along an axis.
#define FIRST_CELL_LEVEL 3u

// The number of crossings of a ray, or the answer of a point, that rounding may have decided.
#define UNSURE 0xFFFFFFFDu

#ifdef __cplusplus
namespace ballot {
#endif

// A point and how far away the nearest triangle may be. A point with a NaN or infinite component, or a limit that is
// negative or NaN, is dead.
struct ProbePoint {
  vec3 at;      // scene units
  float limit;  // scene units; infinite: none
};
BALLOT_RECORD(ProbePoint, 16);

// The nearest point of a mesh.
struct Nearest {
  vec3 at;         // scene units; 0 without a triangle
  float distance;  // scene units; infinite without a triangle within the limit
  uint prim;       // the triangle's number in the order of the scene file, or NO_HIT
  float u;         // the weights of vertices 1 and 2 of the triangle at that point
  float v;
  uint behind;  // with BALLOT_SIDES: 1 if the point is on the inner side of that part of the surface; else 0
};
BALLOT_RECORD(Nearest, 32);

// A triangle within the limit of a point.
struct Within {
  float distance;  // scene units
  uint prim;
};
BALLOT_RECORD(Within, 8);

// A closed box with sides along the axes. It overlaps nothing if it is not finite, or its low corner above its high.
struct ProbeBox {
  vec3 lo;  // scene units
  uint unused_lo;
  vec3 hi;
  uint unused_hi;
};
BALLOT_RECORD(ProbeBox, 32);

// Push constants of neighbours.comp.
struct NeighboursPush {
  uint step;     // NEIGHBOURS_...
  uint first;    // number of the first point
  uint count;    // points
  uint samples;  // tiles that are sampled
  float side;    // longest side of the scene
};
BALLOT_RECORD(NeighboursPush, 20);

// What is known of an order of points.
struct NeighbourState {
  uint first;  // number of the first point
  uint apart;  // sum of how far apart neighbours are
  int lo[3];   // bounds of the points, as integers of the same order
  int hi[3];
};
BALLOT_RECORD(NeighbourState, 32);

// A level of cubic cells around a scene.
struct CellGrid {
  vec3 lo;     // the first corner
  float cell;  // side of a cell
  float pad;   // cells are widened by it
  uint level;
  uint shadows;  // where the level's shadows begin
};
BALLOT_RECORD(CellGrid, 28);

// Push constants of look_up.comp.
struct LookUpPush {
  vec3 lo;        // as of CellGrid
  float inverse;  // cells along a unit
  vec3 middle;    // points are looked up that are no farther from it along each axis than
  float reach;
  float least;  // and whose y and z are 0 or no smaller
  uint level;
  uint first;  // number of the first point
  uint count;
};
BALLOT_RECORD(LookUpPush, 48);

// Push constants of places.comp.
struct PlacesPush {
  uint lists;
  uint tiles;
  uint step;     // PLACES_...
  uint longest;  // list that takes a place; of hits: how many each query has
  uint records;  // room for all lists
};
BALLOT_RECORD(PlacesPush, 20);

// What places.comp knows of the lists so far.
struct AppendedLists {
  uint low;      // word of the sum of their lengths
  uint high;     // word
  uint longest;  // length of the longest one above PlacesPush::longest; 0: none is
};
BALLOT_RECORD(AppendedLists, 12);

// Push constants of order.comp.
struct OrderPush {
  uint lists;
  uint step;     // ORDER_...
  uint row;      // records of a row
  uint longest;  // list that has a place
};
BALLOT_RECORD(OrderPush, 16);

// Push constants of pick.comp.
struct PickPush {
  uint lists;
  uint step;  // PICK_...
  uint most;  // records of a beginning
};
BALLOT_RECORD(PickPush, 12);

// Push constants of columns.comp.
struct ColumnsPush {
  uint records;
  uint from;  // number of the first record
  uint to;    // place of the first answer, a multiple of 4
  uint placements, ranges;
  uint instances;  // of trees
  uint row;        // hits of a ray
};
BALLOT_RECORD(ColumnsPush, 28);

// Push constants of surfaces.comp.
struct SurfacesPush {
  uint records, from, to;  // as of ColumnsPush
};
BALLOT_RECORD(SurfacesPush, 12);

// Push constants of values.comp.
struct ValuesPush {
  uint records, from, to;  // as of ColumnsPush
  uint placements;
  uint table;  // where the attribute's words begin in BIND_VALUE_TABLE
};
BALLOT_RECORD(ValuesPush, 20);

// Push constants of sums.comp.
struct SumsPush {
  uint step;   // SUMS_...
  uint first;  // number of the first weight, hit or sum
  uint count;
  uint row;          // hits of a ray
  uint entries;      // but for the last, of rays that miss
  uint placements;   // of the table
  uint weight_step;  // 1: each ray has a weight, 0: all have the first
  uint lift;         // SumUnit::lift_of(), a signed number
};
BALLOT_RECORD(SumsPush, 32);

// What sums.comp knows of the weights.
struct SumRange {
  uint largest;  // bits of the largest size
  uint wrong;    // number of the first that is not finite; ~0: none
};
BALLOT_RECORD(SumRange, 8);

// Where a column's numbers of a question lie, in words of a table.
struct MadeColumn {
  uint at;                 // those of the first question
  uint stride[MADE_AXES];  // to those of the next along each axis
};
BALLOT_RECORD(MadeColumn, 36);

// How questions are made of tables.
struct MadeQuestions {
  uint axes;
  uint shape[MADE_AXES];  // the last axis is the fastest
  uint width;             // rows that are taken in tiles are so long; 0: none are
  uint tiled;             // questions in whole bands of such rows
  MadeColumn columns[MADE_COLUMNS];
};
BALLOT_RECORD(MadeQuestions, 224);

// Push constants of made.comp.
struct MadePush {
  uint first;  // number of the first question
  uint count;
};
BALLOT_RECORD(MadePush, 8);

#ifdef __cplusplus
}  // namespace ballot
#endif

#endif  // BALLOT_QUERY_H
