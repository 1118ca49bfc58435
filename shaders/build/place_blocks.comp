#version 460
#extension GL_GOOGLE_include_directive : require
// Replaces what each block needs by what all blocks before it need (lib/build/places.glsl). One workgroup.
#include "../lib/build/places.glsl"

BUILD_MAIN {
  uvec2 sum = uvec2(0u), total;
  for (uint first = 0u; first < push.blocks; first += GROUP_SIZE) {
    uint block = first + lane_of_group();
    uvec2 need = block < push.blocks ? sums[block] : uvec2(0u), before;
    before.x = sum_before(need.x, total.x);
    before.y = sum_before(need.y, total.y);
    if (block < push.blocks) sums[block] = sum + before;
    sum += total;
  }
  if (lane_of_group() == 0u) store_totals(sum);
}
