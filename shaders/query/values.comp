#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Values of an attribute where rays hit, or at the nearest points of points. NaN where there is none.
//
// Kernel configuration:
// BALLOT_POINTS      1: the records are Nearest, else Hit
// BALLOT_COMPONENTS  numbers of a value, 1 to 4
// One invocation a record, without divergence but in searches. Numbers that are not interpolated are copied as words.
#include "../shared/query.h"

layout(local_size_x = COLUMNS_GROUP) in;
layout(push_constant, scalar) uniform Push { ValuesPush push; };

#include "../lib/query/answers.glsl"

layout(set = 0, binding = BIND_VALUE_TABLE, scalar) readonly buffer Table { uint table[]; };
layout(set = 0, binding = BIND_VALUES, scalar) readonly buffer Given { uint given[]; };
layout(set = 0, binding = BIND_VALUE_CORNERS, scalar) readonly buffer Corners { uint corners[]; };
layout(set = 0, binding = BIND_COLUMNS, scalar) writeonly buffer Values { uint values[]; };
SEARCH(find_placement, table)

// Writes a value that is not interpolated, whose first word is `from`.
void copy(uint from, uint to) {
  for (uint k = 0u; k < BALLOT_COMPONENTS; ++k) values[to + k] = given[from + k];
}

// Writes the value between those of three vertices, by the weights of the last two.
void interpolate(uvec3 from, vec2 uv, uint to) {
  for (uint k = 0u; k < BALLOT_COMPONENTS; ++k) {
    float a = uintBitsToFloat(given[from.x + k]), b = uintBitsToFloat(given[from.y + k]),
          c = uintBitsToFloat(given[from.z + k]);
    precise float value = a + (uv.x * (b - a) + uv.y * (c - a));
    values[to + k] = floatBitsToUint(value);
  }
}

void write_value(Record record, uint to) {
  uint placement = find_placement(0u, push.placements, record.prim), triangle = record.prim - table[placement];
  uint at = push.table + VALUE_WORDS * table[push.placements + placement];
  uint kind = table[at], first = table[at + 1u], indices = table[at + 2u];
  if (kind == VALUES_OF_MESH) {
    copy(first, to);
  } else if (kind == VALUES_OF_PRIMS) {
    copy(first + BALLOT_COMPONENTS * triangle, to);
  } else if (kind != VALUES_NONE) {
    uvec3 vertex = 3u * triangle + uvec3(0u, 1u, 2u);
    if (indices != NO_HIT) {
      uvec3 at_corner = indices + vertex;
      vertex = uvec3(corners[at_corner.x], corners[at_corner.y], corners[at_corner.z]);
    }
    vec2 uv = uintBitsToFloat(record.uv);
    uvec3 words = first + BALLOT_COMPONENTS * vertex;
    if (kind == VALUES_OF_VERTICES) {
      interpolate(words, uv, to);
    } else {
      precise float w = 1.0 - uv.x - uv.y;
      copy(w >= uv.x && w >= uv.y ? words.x : uv.x >= uv.y ? words.y : words.z, to);
    }
  }
}

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= push.records) return;
  uint to = BALLOT_COMPONENTS * (push.to + i);
  for (uint k = 0u; k < BALLOT_COMPONENTS; ++k) values[to + k] = 0x7FC00000u;
  Record record = record_of(push.from + i);
  if (record.prim != NO_HIT) write_value(record, to);
}
