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
// One invocation a record, without divergence but in searches. Numbers are copied as words, since devices may flush
// denormal floats.
#include "../shared/query.h"

#define WANTS(column) ((BALLOT_COLUMNS >> column & 1) == 1)
#define OUT(column) layout(set = 0, binding = BIND_COLUMNS + column, scalar)

layout(local_size_x = COLUMNS_GROUP) in;
layout(push_constant, scalar) uniform Push { ColumnsPush push; };

struct Record {
  uint prim, distance;
  uvec2 uv;
};
#if BALLOT_POINTS
layout(set = 0, binding = BIND_HITS, scalar) readonly buffer Found { uvec4 found[]; };  // two a record: Nearest
Record record_of(uint i) { return Record(found[2u * i + 1u].x, found[2u * i].w, found[2u * i + 1u].yz); }
#else
layout(set = 0, binding = BIND_HITS, scalar) readonly buffer Found { uvec4 found[]; };  // Hit
Record record_of(uint i) { return Record(found[i].y, found[i].y != NO_HIT ? found[i].x : 0x7F800000u, found[i].zw); }
#endif

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

// Defines NAME(begin, count, number): the last of `count` rising numbers of `table` from `begin` on that is not above
// `number`. The first is not.
#define SEARCH(NAME, table)                         \
  uint NAME(uint begin, uint count, uint number) {  \
    uint low = 0u, high = count;                    \
    while (high - low > 1u) {                       \
      uint middle = (low + high) / 2u;              \
      if (table[begin + middle] <= number)          \
        low = middle;                               \
      else                                          \
        high = middle;                              \
    }                                               \
    return low;                                     \
  }

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

#if WANTS(COLUMN_NORMALS)
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

uvec3 normal_of(uint prim, uvec2 uv) {
  if (prim == NO_HIT) return uvec3(0u);
#if BALLOT_MOVED
  uint tree = find_tree(0u, push.instances, prim), at = push.instances + (CORNER_WORDS - 1u) * tree;
  if (corner_table[at] == NO_HIT) return shape_normal(at + 1u, uv);
  uint first = 3u * (prim - corner_table[tree] + corner_table[at]);
  return unit_normal(moved(at + 1u, corners[first]), moved(at + 1u, corners[first + 1u]),
                     moved(at + 1u, corners[first + 2u]));
#else
  return unit_normal(corners[3u * prim], corners[3u * prim + 1u], corners[3u * prim + 2u]);
#endif
}
#endif

#if WANTS(COLUMN_FLAGS)
// Writes those of up to four records as the word that they share.
void write_flags(uint i) {
  uint word = 0u, mask = 0u, at = (push.to + i) / 4u;
  for (uint k = 0u; k < min(push.records - i, 4u); ++k) {
    mask |= 0xFFu << 8u * k;
    word |= uint(is_set(push.from + i + k)) << 8u * k;
  }
  flags[at] = mask == ~0u ? word : (flags[at] & ~mask) | word;
}
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
  normals[to] = normal_of(record.prim, record.uv);
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
