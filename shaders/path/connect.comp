#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Light to the paths whose shadow rays met nothing.
#include "../shared/render.h"
#include "../lib/records.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { uint call; };
RECORDS_IN(BIND_HITS, Hits, hits)
RECORDS_IN(BIND_SHADOW_LIGHT, ShadowLight, shadow_light)
layout(set = 0, binding = BIND_WAVE_CALLS, scalar) readonly buffer Calls { Call calls[]; };
RECORDS_INOUT(BIND_PATHS, Paths, paths)

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index >= calls[call].count || get_hit(hits, index).prim != NO_HIT) return;
  Awaited light = get_awaited(shadow_light, index);
  Path path = get_path(paths, light.path);
  path.radiance += light.radiance;
  put_part(paths, light.path, path);
}
