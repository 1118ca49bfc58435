#version 460
#extension GL_GOOGLE_include_directive : require
// Prepares a tree for refits: writes the parent of each triangle and of each node but the root.
//
// Nodes have the numbers of all positions in Morton order but one, which the root still has as its key.
#include "../lib/build/frame.glsl"

layout(push_constant, scalar) uniform Push { WritePush push; };
layout(set = 0, binding = BIND_BUILD_STATE, scalar) readonly buffer State { BuildState state; };
layout(set = 0, binding = BIND_BUILD_CLUSTERS, std430) writeonly buffer Parents { uint parents[]; };
#define NODES_ACCESS
#include "../lib/build/triangles.glsl"
#include "../lib/build/clusters.glsl"

void main() {
  if (state.proper <= 1u) return;  // there are no nodes
  uint unused = nodes[index_of(state.root) * BUILD_NODE_TEXELS + 2u].y;
  for (uint i = gl_GlobalInvocationID.x; i < min(state.proper, push.triangles); i += gl_NumWorkGroups.x * GROUP_SIZE) {
    if (i == unused) continue;
    for (uint side = 0u; side < 2u; ++side) {
      uint child = nodes[i * BUILD_NODE_TEXELS + side].w;
      if (is_triangle(child))
        parents[index_of(child)] = i;
      else
        nodes[index_of(child) * BUILD_NODE_TEXELS + 2u].y = i;
    }
  }
}
