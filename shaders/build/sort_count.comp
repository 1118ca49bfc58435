#version 460
#extension GL_GOOGLE_include_directive : require
// Builds the histogram of digit values of each tile (lib/build/sort.glsl).
#include "../lib/build/sort.glsl"

layout(set = 0, binding = BIND_BUILD_KEYS, std430) readonly buffer Keys { Key keys[]; };

shared uint tile_counts[BUILD_DIGITS];

void main() {
  if (key_count() == 0u) return;
  for (uint d = gl_LocalInvocationIndex; d < BUILD_DIGITS; d += GROUP_SIZE) tile_counts[d] = 0u;
  barrier();
  uint first = gl_WorkGroupID.x * TILE, end = min(first + TILE, key_count());
  for (uint i = first + gl_LocalInvocationIndex; i < end; i += GROUP_SIZE)
    atomicAdd(tile_counts[digit_of(keys[i], push.shift)], 1u);
  barrier();
  for (uint d = gl_LocalInvocationIndex; d < BUILD_DIGITS; d += GROUP_SIZE)
    counts[d * push.tiles + gl_WorkGroupID.x] = tile_counts[d];
}
