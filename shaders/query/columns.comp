#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Columns: from the hits of rays, or the nearest points of points, those columns of the answers that are asked for.
//
// Kernel configuration:
// BALLOT_COLUMNS  a bit for each column that is written (COLUMN_... of shaders/shared/query.h)
// BALLOT_POINTS   1: the records are Nearest, else Hit
// BALLOT_PARITY   of points: 1: BIND_CROSSINGS tells which are inside, 0: Nearest::behind does
// BALLOT_RANGES   1: ids belong to ranges of triangles, 0: to placements
// BALLOT_MOVED    1: triangles are those of instances
// BALLOT_SHAPES   1: some of these are shapes, 0: none is, or the columns do not ask
// One invocation a record, without divergence but in searches. Numbers are copied as words, since devices may flush
// denormal floats.
#include "../shared/query.h"

#define WANTS(column) ((BALLOT_COLUMNS >> column & 1) == 1)

layout(local_size_x = COLUMNS_GROUP) in;
layout(push_constant, scalar) uniform Push { ColumnsPush push; };

#include "../lib/query/answers.glsl"

#if !BALLOT_POINTS
bool is_set(uint i) { return found[i].y != NO_HIT; }
#elif BALLOT_PARITY
layout(set = 0, binding = BIND_CROSSINGS, scalar) readonly buffer Inside { uint inside[]; };
bool is_set(uint i) { return inside[i] != 0u; }
#else
bool is_set(uint i) { return found[2u * i + 1u].w != 0u; }
#endif

#if WANTS(COLUMN_DISTANCES)
OUT(COLUMN_DISTANCES) writeonly buffer Distances { uint distances[]; };
#endif
#if WANTS(COLUMN_PRIMS)
OUT(COLUMN_PRIMS) writeonly buffer Prims { uint prims[]; };
#endif
#if WANTS(COLUMN_IDS)
OUT(COLUMN_IDS) writeonly buffer Ids { uint ids[]; };
#endif
#if WANTS(COLUMN_UVS)
OUT(COLUMN_UVS) writeonly buffer Uvs { uvec2 uvs[]; };
#endif
#if WANTS(COLUMN_NORMALS)
OUT(COLUMN_NORMALS) writeonly buffer Normals { uvec3 normals[]; };
#endif
#if WANTS(COLUMN_FLAGS)
OUT(COLUMN_FLAGS) buffer Flags { uint flags[]; };
#endif
#if WANTS(COLUMN_FLAG_WORDS)
OUT(COLUMN_FLAG_WORDS) writeonly buffer FlagWords { uint flag_words[]; };
#endif
#if WANTS(COLUMN_INSTANCES)
OUT(COLUMN_INSTANCES) writeonly buffer Instances { uint instances[]; };
#endif
#if WANTS(COLUMN_POINTS)
OUT(COLUMN_POINTS) writeonly buffer Points { uvec3 points[]; };
#endif
#if WANTS(COLUMN_SIGNED)
OUT(COLUMN_SIGNED) writeonly buffer Signed { uint signed_distances[]; };
#endif
#if WANTS(COLUMN_POSITIONS)
OUT(COLUMN_POSITIONS) writeonly buffer Positions { uvec3 positions[]; };
#endif
#if WANTS(COLUMN_FRONT)
OUT(COLUMN_FRONT) buffer Fronts { uint fronts[]; };
#endif
#if WANTS(COLUMN_FRONT_WORDS)
OUT(COLUMN_FRONT_WORDS) writeonly buffer FrontWords { uint front_words[]; };
#endif

#if WANTS(COLUMN_PRIMS) || WANTS(COLUMN_IDS) || WANTS(COLUMN_INSTANCES)
layout(set = 0, binding = BIND_PRIM_TABLE, scalar) readonly buffer PrimTable { uint prim_table[]; };
SEARCH(find_prim, prim_table)

void write_places(uint prim, uint to) {
  uint triangle = NO_HIT, instance = NO_HIT, id = NO_HIT;
  if (prim != NO_HIT) {
    uint n = push.placements, place = find_prim(0u, n, prim);
    triangle = prim - prim_table[place];
    instance = prim_table[n + place];
    id = prim_table[2u * n + place];
#if BALLOT_RANGES && WANTS(COLUMN_IDS)
    uint ranges = PLACEMENT_WORDS * n;
    id = prim_table[ranges + push.ranges + find_prim(ranges, push.ranges, prim + prim_table[3u * n + place])];
#endif
  }
#if WANTS(COLUMN_PRIMS)
  prims[to] = triangle;
#endif
#if WANTS(COLUMN_IDS)
  ids[to] = id;
#endif
#if WANTS(COLUMN_INSTANCES)
  instances[to] = instance;
#endif
}
#endif

#define OF_SIDES (WANTS(COLUMN_FRONT) || WANTS(COLUMN_FRONT_WORDS))
#if WANTS(COLUMN_NORMALS) || WANTS(COLUMN_POSITIONS) || OF_SIDES
#include "../lib/query/unit_normal.glsl"
layout(set = 0, binding = BIND_CORNERS, scalar) readonly buffer Corners { vec3 corners[]; };
#if BALLOT_MOVED
layout(set = 0, binding = BIND_CORNER_TABLE, scalar) readonly buffer CornerTable { uint corner_table[]; };
SEARCH(find_tree, corner_table)

// Returns the vertex where the instance whose matrix begins at `at` has it, with the bits of Forest::triangle().
vec3 moved(uint at, vec3 vertex) {
  dvec3 v = widen(vertex);
  vec3 to;
  for (uint r = 0u; r < 3u; ++r, at += 4u) {
    double x = widen(uintBitsToFloat(corner_table[at])), y = widen(uintBitsToFloat(corner_table[at + 1u])),
           z = widen(uintBitsToFloat(corner_table[at + 2u])), t = widen(uintBitsToFloat(corner_table[at + 3u]));
    precise double sum = x * v.x + y * v.y + z * v.z + t;
    to[r] = narrow(sum);
  }
  return to;
}
#endif

#if BALLOT_MOVED
// Returns the normal that u and v of a shape's hit tell, where the instance whose matrix begins at `at` has it, with
// the bits of normal_of_shape() of engine/model/shapes.cpp.
uvec3 shape_normal(uint at, uvec2 uv) {
  precise double x = 2.0lf * widen(uintBitsToFloat(uv.x)) - 1.0lf, y = 2.0lf * widen(uintBitsToFloat(uv.y)) - 1.0lf;
  precise double z = 1.0lf - abs(x) - abs(y), fold_x = 1.0lf - abs(y), fold_y = 1.0lf - abs(x);
  dvec3 n = dvec3(x, y, z);
  if (z < 0.0lf) n = dvec3(x < 0.0lf ? -fold_x : fold_x, y < 0.0lf ? -fold_y : fold_y, z);
  double m[3][3];
  for (uint k = 0u; k < 9u; ++k)
    m[k / 3u][k % 3u] = widen(uintBitsToFloat(corner_table[at + 4u * (k / 3u) + k % 3u]));
  precise double c[3][3], det;
  for (uint k = 0u; k < 9u; ++k) {
    uint r = k / 3u, i = (r + 1u) % 3u, j = (r + 2u) % 3u, p = (k + 1u) % 3u, q = (k + 2u) % 3u;
    c[r][k % 3u] = m[i][p] * m[j][q] - m[i][q] * m[j][p];
  }
  det = m[0][0] * c[0][0] + m[0][1] * c[0][1] + m[0][2] * c[0][2];
  precise dvec3 to = dvec3(c[0][0] * n.x + c[0][1] * n.y + c[0][2] * n.z, c[1][0] * n.x + c[1][1] * n.y + c[1][2] * n.z,
                           c[2][0] * n.x + c[2][1] * n.y + c[2][2] * n.z);
  return unit_bits(det < 0.0lf ? -to : to);
}
#endif

// What a hit is on: the vertices of a triangle where it lies in the world, or a shape.
struct Met {
  vec3 a, b, c;
  bool shape;
  uint matrix;  // of the instance: its first word
};
Met met(uint prim) {
#if BALLOT_MOVED
  uint tree = find_tree(0u, push.instances, prim), at = push.instances + (CORNER_WORDS - 1u) * tree;
  if (corner_table[at] == NO_HIT) return Met(vec3(0.0), vec3(0.0), vec3(0.0), true, at + 1u);
  uint first = 3u * (prim - corner_table[tree] + corner_table[at]);
  return Met(moved(at + 1u, corners[first]), moved(at + 1u, corners[first + 1u]), moved(at + 1u, corners[first + 2u]),
             false, at + 1u);
#else
  return Met(corners[3u * prim], corners[3u * prim + 1u], corners[3u * prim + 2u], false, 0u);
#endif
}

#if WANTS(COLUMN_NORMALS) || BALLOT_SHAPES
uvec3 normal_of(Met on, uvec2 uv) {
#if BALLOT_MOVED
  if (on.shape) return shape_normal(on.matrix, uv);
#endif
  return unit_normal(on.a, on.b, on.c);
}
#endif

#if OF_SIDES || BALLOT_SHAPES
layout(set = 0, binding = BIND_RAYS, scalar) readonly buffer Rays { Ray rays[]; };
#endif

#if WANTS(COLUMN_POSITIONS)
// Returns where a hit is, with the bits of position_of() of engine/api/hit_geometry.cpp.
uvec3 position_of(Met on, Record record, uint ray) {
#if BALLOT_SHAPES
  if (on.shape) {
    double t = widen(uintBitsToFloat(record.distance));
    dvec3 origin = widen(rays[ray].origin), dir = widen(rays[ray].dir);
    precise dvec3 along = origin + t * dir;
    return floatBitsToUint(vec3(narrow(along.x), narrow(along.y), narrow(along.z)));
  }
#endif
  double u = widen(uintBitsToFloat(record.uv.x)), v = widen(uintBitsToFloat(record.uv.y));
  dvec3 a = widen(on.a), b = widen(on.b), c = widen(on.c);
  precise dvec3 to = a + (u * (b - a) + v * (c - a));
  return floatBitsToUint(vec3(narrow(to.x), narrow(to.y), narrow(to.z)));
}
#endif

#if OF_SIDES
// Returns whether a ray meets the front, as is_front() of engine/api/hit_geometry.cpp finds it.
bool is_front(Met on, Record record, uint ray) {
  dvec3 n;
#if BALLOT_SHAPES
  if (on.shape)
    n = widen(uintBitsToFloat(normal_of(on, record.uv)));
  else
#endif
    n = area_vector(on.a, on.b, on.c);
  dvec3 d = widen(rays[ray].dir);
  precise double side = n.x * d.x + n.y * d.y + n.z * d.z;
  return side < 0.0lf;
}

// The same for the hit of a record, which may be a miss.
bool meets_front(uint i) {
  Record record = record_of(i);
  return record.prim != NO_HIT && is_front(met(record.prim), record, i / push.row);
}
#endif
#endif

// Defines NAME(i), which writes those of up to four records as the word that they share.
#define WRITE_BYTES(NAME, bytes, of)                            \
  void NAME(uint i) {                                           \
    uint word = 0u, mask = 0u, at = (push.to + i) / 4u;         \
    for (uint k = 0u; k < min(push.records - i, 4u); ++k) {     \
      mask |= 0xFFu << 8u * k;                                  \
      word |= uint(of(push.from + i + k)) << 8u * k;            \
    }                                                           \
    bytes[at] = mask == ~0u ? word : (bytes[at] & ~mask) | word; \
  }
#if WANTS(COLUMN_FLAGS)
WRITE_BYTES(write_flags, flags, is_set)
#endif
#if WANTS(COLUMN_FRONT)
WRITE_BYTES(write_fronts, fronts, meets_front)
#endif

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= push.records) return;
  uint from = push.from + i, to = push.to + i;
  Record record = record_of(from);
#if WANTS(COLUMN_DISTANCES)
  distances[to] = record.distance;
#endif
#if WANTS(COLUMN_PRIMS) || WANTS(COLUMN_IDS) || WANTS(COLUMN_INSTANCES)
  write_places(record.prim, to);
#endif
#if WANTS(COLUMN_UVS)
  uvs[to] = record.uv;
#endif
#if WANTS(COLUMN_NORMALS)
  normals[to] = record.prim == NO_HIT ? uvec3(0u) : normal_of(met(record.prim), record.uv);
#endif
#if WANTS(COLUMN_POSITIONS)
  positions[to] = record.prim == NO_HIT ? uvec3(0u) : position_of(met(record.prim), record, from / push.row);
#endif
#if WANTS(COLUMN_FRONT)
  if (i % 4u == 0u) write_fronts(i);
#endif
#if WANTS(COLUMN_FRONT_WORDS)
  front_words[to] = uint(meets_front(from));
#endif
#if WANTS(COLUMN_FLAGS)
  if (i % 4u == 0u) write_flags(i);
#endif
#if WANTS(COLUMN_FLAG_WORDS)
  flag_words[to] = uint(is_set(from));
#endif
#if WANTS(COLUMN_POINTS)
  points[to] = found[2u * from].xyz;
#endif
#if WANTS(COLUMN_SIGNED)
  signed_distances[to] = is_set(from) ? record.distance ^ 0x80000000u : record.distance;
#endif
}
