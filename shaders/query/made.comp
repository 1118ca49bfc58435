#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Made: questions of tables that many of them share, such as the directions of a camera's pixels and its poses, or the
// axes of a grid.
//
// BALLOT_MADE has one of the values of MADE_... (shaders/shared/query.h). One invocation a question, without
// divergence. Numbers are copied as they are. A pose moves the origin as a point and the direction as a vector, each
// float32 product and sum rounded, in the order that engine/api/sources.cpp has.
#include "../shared/query.h"

layout(local_size_x = MADE_GROUP) in;
layout(push_constant, scalar) uniform Push { MadePush push; };
layout(set = 0, binding = BIND_MADE_HOW, scalar) readonly buffer How { MadeQuestions how; };
layout(set = 0, binding = BIND_MADE_WORDS, scalar) readonly buffer Words { uint words[]; };
layout(set = 0, binding = BIND_RAYS, scalar) writeonly buffer Questions { uvec4 questions[]; };

#if BALLOT_MADE == MADE_POSED_RAYS
#define READ_COLUMNS 5
#else
#define READ_COLUMNS 4
#endif

// RowOrder::run_at() of engine/api/row_order.h
uint place_of(uint at) {
  if (at >= how.tiled) return at;
  uint whole = how.width / 8u * 8u, rest = how.width - whole, band_rays = 8u * how.width;
  uint in_band = at % band_rays, band = at - in_band;
  if (in_band >= 8u * whole) {
    uint k = in_band - 8u * whole;
    return band + k / rest * how.width + whole + k % rest;
  }
  uint tile = in_band / 64u, block = in_band / 8u % 8u, lane = in_band % 8u;
  return band + tile * 8u + block % 2u * 4u + (block / 2u * 2u + lane / 4u) * how.width + lane % 4u;
}

vec3 vector_at(uint at) {
  return vec3(uintBitsToFloat(words[at]), uintBitsToFloat(words[at + 1u]), uintBitsToFloat(words[at + 2u]));
}

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= push.count) return;
  uint at[READ_COLUMNS];
  for (int k = 0; k < READ_COLUMNS; ++k) at[k] = how.columns[k].at;
  uint place = place_of(push.first + i);
  for (uint a = how.axes; a-- > 0u;) {
    uint next = place / how.shape[a], here = place - next * how.shape[a];
    for (int k = 0; k < READ_COLUMNS; ++k) at[k] += here * how.columns[k].stride[a];
    place = next;
  }
#if BALLOT_MADE == MADE_POINTS
  questions[i] = uvec4(words[at[0]], words[at[1]], words[at[2]], words[at[3]]);
#else
  uvec3 origin = uvec3(words[at[0]], words[at[0] + 1u], words[at[0] + 2u]);
  uvec3 direction = uvec3(words[at[2]], words[at[2] + 1u], words[at[2] + 2u]);
#if BALLOT_MADE == MADE_POSED_RAYS
  vec3 o = uintBitsToFloat(origin), d = uintBitsToFloat(direction);
  for (uint row = 0u; row < 3u; ++row) {
    uint from = at[4] + 4u * row;
    vec3 m = vector_at(from);
    precise float point = ((m.x * o.x + m.y * o.y) + m.z * o.z) + uintBitsToFloat(words[from + 3u]);
    precise float vector = (m.x * d.x + m.y * d.y) + m.z * d.z;
    origin[row] = floatBitsToUint(point), direction[row] = floatBitsToUint(vector);
  }
#endif
  questions[2u * i] = uvec4(origin, words[at[1]]);
  questions[2u * i + 1u] = uvec4(direction, words[at[3]]);
#endif
}
