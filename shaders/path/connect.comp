#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Light to the paths whose shadow rays met nothing.
#include "../shared/render.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { uint call; };
layout(set = 0, binding = BIND_HITS, scalar) readonly buffer Hits { Hit hits[]; };
layout(set = 0, binding = BIND_SHADOW_LIGHT, scalar) readonly buffer ShadowLight { Awaited shadow_light[]; };
layout(set = 0, binding = BIND_WAVE_CALLS, scalar) readonly buffer Calls { Call calls[]; };
layout(set = 0, binding = BIND_PATHS, scalar) buffer Paths { Path paths[]; };

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index >= calls[call].count || hits[index].prim != NO_HIT) return;
  Awaited light = shadow_light[index];
  paths[light.path].radiance += light.radiance;
}
