#version 460
#extension GL_GOOGLE_include_directive : require
// Gathers rays in their order.
#include "../lib/reorder/frame.glsl"

RECORDS_IN(BIND_RAYS, Rays, rays)
layout(set = 0, binding = BIND_REORDER_ORDER, std430) readonly buffer Order { uint order[]; };
RECORDS_OUT(BIND_REORDER_RAYS, RaysOut, rays_out)

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= ray_count()) return;
  uint place = push.first + order[i];
  Ray ray = get_ray(rays, place);
  put_record(rays_out, i, ray);
}
