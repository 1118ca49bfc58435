#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Signs: for each point, its distance, negative inside, or whether it is inside, from what the kernels of points found.
//
// BALLOT_SIGNS has one of the values of SIGNS_... (shaders/shared/query.h). One invocation a point, without divergence.
#include "../shared/query.h"

layout(local_size_x = SIGNS_GROUP) in;
layout(push_constant, scalar) uniform Push { SignsPush push; };
layout(set = 0, binding = BIND_HITS, scalar) readonly buffer Found { Nearest found[]; };
#if BALLOT_SIGNS == SIGNS_BY_PARITY
layout(set = 0, binding = BIND_CROSSINGS, scalar) readonly buffer Inside { uint inside[]; };
#elif BALLOT_SIGNS == SIGNS_INSIDE
layout(set = 0, binding = BIND_CROSSINGS, scalar) writeonly buffer Inside { uint inside[]; };
#endif
#if BALLOT_SIGNS != SIGNS_INSIDE
layout(set = 0, binding = BIND_DISTANCES, scalar) writeonly buffer Distances { float distances[]; };
#endif

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= push.points) return;
#if BALLOT_SIGNS == SIGNS_BY_PARITY
  distances[push.to + i] = inside[i] != 0u ? -found[i].distance : found[i].distance;
#elif BALLOT_SIGNS == SIGNS_BY_SIDES
  distances[push.to + i] = found[i].behind != 0u ? -found[i].distance : found[i].distance;
#else
  inside[push.to + i] = found[i].behind;
#endif
}
