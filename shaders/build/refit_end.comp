#version 460
#extension GL_GOOGLE_include_directive : require
// Derives from a refitted tree what write.comp and the host need: the bounds, the point that boxes are measured from,
// and the cost of the whole tree. One invocation.
#include "../lib/build/frame.glsl"

layout(push_constant, scalar) uniform Push { RefitPush push; };
layout(set = 0, binding = BIND_BUILD_STATE, scalar) buffer State { BuildState state; };
#include "../lib/build/order.glsl"
#include "../lib/build/origin.glsl"
#include "../lib/build/triangles.glsl"
#include "../lib/build/area.glsl"
#include "../lib/build/clusters.glsl"
#include "../lib/build/refit.glsl"

void main() {
  if (gl_GlobalInvocationID.x != 0u || state.proper == 0u) return;
  unit = push.unit;
  Item root = refitted(state.root);
  if (changed) state.changed = 1u;
  uvec3 lo = ordered(root.lo), hi = ordered(root.hi);
  for (uint k = 0u; k < 3u; ++k) {
    state.lo[k] = lo[k];
    state.hi[k] = hi[k];
  }
  vec3 sides = root.hi - root.lo;
  float longest = max(sides.x, max(sides.y, sides.z)), scale = unit_of(longest) / unit;
  state.cost = root.cost * scale * scale;
  state.corner = root.lo;
  state.longest = longest;
  state.origin = box_origin(root.lo, root.hi);
}
