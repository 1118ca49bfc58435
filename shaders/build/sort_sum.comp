#version 460
#extension GL_GOOGLE_include_directive : require
// Exclusive scan of the histograms over the tiles, one digit value a workgroup (lib/build/sort.glsl).
#include "../lib/build/sort.glsl"

layout(set = 0, binding = BIND_BUILD_TOTALS, std430) writeonly buffer Totals { uint totals[]; };

BUILD_MAIN {
  if (key_count() == 0u) return;
  uint row = gl_WorkGroupID.x * push.tiles, sum = 0u;
  for (uint first = 0u; first < push.tiles; first += GROUP_SIZE) {
    uint tile = first + lane_of_group();
    uint count = 0u, total;
    if (tile < push.tiles) count = counts[row + tile];
    uint before = sum_before(count, total);
    if (tile < push.tiles) counts[row + tile] = sum + before;
    sum += total;
  }
  if (lane_of_group() == 0u) totals[gl_WorkGroupID.x] = sum;
}
