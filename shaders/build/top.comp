#version 460
#extension GL_GOOGLE_include_directive : require
// Writes the nodes of the top-level tree (shaders/shared/layout.h): each lies at the number of its node of the build.
#define BALLOT_BOXES 1
#include "../lib/build/frame.glsl"

layout(push_constant, scalar) uniform Push { WritePush push; };
layout(set = 0, binding = BIND_BUILD_STATE, scalar) readonly buffer State { BuildState state; };
layout(set = 0, binding = BIND_BUILD_TOP, std430) writeonly buffer Top { uvec4 written_texels[]; };
#include "../lib/build/triangles.glsl"
#include "../lib/build/clusters.glsl"

void write_child(uint texel, uint cluster) {
  vec3 lo, hi;
  uint reference;
  float slack;
  if (is_triangle(cluster)) {
    uint instance = prims[index_of(cluster)];
    Corners box = corners_of(instance);
    lo = box.a;
    hi = box.b;
    slack = box.slack;
    reference = LEAF_BIT | instance;
  } else {
    Item item = item_of_node(cluster);
    lo = item.lo;
    hi = item.hi;
    slack = from_half(item.side_z_shape & 0xFFFFu);
    reference = index_of(cluster) * TOP_NODE_TEXELS;
  }
  written_texels[texel] = uvec4(floatBitsToUint(lo), reference);
  written_texels[texel + 1u] = uvec4(floatBitsToUint(hi), floatBitsToUint(slack));
}

void main() {
  if (state.proper <= 1u) return;  // there are no nodes
  uint unused = nodes[index_of(state.root) * BUILD_NODE_TEXELS + 2u].y;
  for (uint i = gl_GlobalInvocationID.x; i < state.proper; i += gl_NumWorkGroups.x * GROUP_SIZE) {
    if (i == unused) continue;
    write_child(i * TOP_NODE_TEXELS, nodes[i * BUILD_NODE_TEXELS].w);
    write_child(i * TOP_NODE_TEXELS + 2u, nodes[i * BUILD_NODE_TEXELS + 1u].w);
  }
}
