#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Look-up: answers the inside test of points whose cell no triangle touches (cells.comp), and lists the numbers of the
// others, for inside.comp. One point a lane.
//
// A point beyond the cells has the answer of the nearest one: the cells at the sides lie outside of the scene, and of
// points before the scene their row alone counts. A point that is not finite, far away or all too near to a plane y = 0
// or z = 0 is listed (cells.comp has the proof).
#include "../shared/query.h"
#include "../lib/query/cell_code.glsl"

layout(local_size_x = LOOK_UP_GROUP) in;
layout(push_constant, scalar) uniform Push { LookUpPush push; };
layout(set = 0, binding = BIND_RAYS, std430) readonly buffer Points { vec4 points[]; };
layout(set = 0, binding = BIND_CROSSINGS, scalar) writeonly buffer Answers { uint answers[]; };
layout(set = 0, binding = BIND_CELLS, std430) readonly buffer Cells { uint cells[]; };
layout(set = 0, binding = BIND_LISTED_POINTS, std430) writeonly buffer ListedPoints { uint listed[]; };
layout(set = 0, binding = BIND_LISTED_COUNT, std430) buffer ListedCount { uint listed_count; };

bool is_known(vec3 at) {
  uvec3 bits = floatBitsToUint(abs(at));
  uint most = max(bits.x, max(bits.y, bits.z)), least = floatBitsToUint(push.least);
  vec3 from = abs(at - push.middle);
  return most < 0x7F800000u && max(from.x, max(from.y, from.z)) <= push.reach && bits.y - 1u >= least - 1u &&
         bits.z - 1u >= least - 1u;
}

void main() {
  bool live = gl_GlobalInvocationID.x < push.count;
  uint index = push.first + (live ? gl_GlobalInvocationID.x : 0u), state = CELL_TOUCHED;
  vec3 at = points[index].xyz;
  if (is_known(at)) {
    vec3 cell = clamp((at - push.lo) * push.inverse, vec3(0.0), vec3((1u << push.level) - 1u));
    uint code = code_of(uvec3(cell));
    state = CELL_IN(cells, code);
  }
  bool is_listed = live && state == CELL_TOUCHED;
  if (is_listed) listed[atomicAdd(listed_count, 1u)] = index;
  if (live && !is_listed) answers[index] = state;
}
