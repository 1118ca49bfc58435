#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Adds the light of unoccluded shadow rays to their paths.
#include "../shared/render.h"
#include "../lib/frame/records.glsl"

layout(local_size_x = PASS_GROUP) in;
layout(push_constant, scalar) uniform Push { uint args; };
RECORDS_IN(BIND_HITS, Hits, hits)
RECORDS_IN(BIND_SHADOW_LIGHT, ShadowLight, shadow_payload)
layout(set = 0, binding = BIND_WAVE_INDIRECT, scalar) readonly buffer Indirect { IndirectArgs indirect[]; };
RECORDS_INOUT(BIND_PATHS, Paths, paths)

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index >= indirect[args].count || get_hit(hits, index).prim != NO_HIT) return;
  ShadowPayload light = get_shadow_payload(shadow_payload, index);
  Path path = get_path(paths, light.path);
  path.radiance += light.radiance;
  put_part(paths, light.path, path);
}
