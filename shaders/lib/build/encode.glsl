// What the kernels share that write the nodes of a wide tree from its pairs (collapse.glsl): bindings, and the boxes of
// a node's children. The files that include this one define BALLOT_WIDTH first, and then encode(node, pair).
#include "frame.glsl"

layout(push_constant, scalar) uniform Push { EncodePush push; };
layout(set = 0, binding = BIND_BUILD_STARTS, std430) readonly buffer Starts { uvec2 starts[]; };
layout(set = 0, binding = BIND_BUILD_WIDE_NODES, std430) readonly buffer WideNodes { uint wide_nodes[]; };
layout(set = 0, binding = BIND_BUILD_FORMAT, std430) writeonly buffer Format { uvec4 texels[]; };
#define BALLOT_LAYOUT LAYOUT_INTERLEAVED
#include "read_pair.glsl"
#include "collapse.glsl"
#include "members.glsl"

Child child_of(uint member) { return read_child(texel_of(member >> 1), member & 1u); }

void encode(uint node, uint pair);

void main() {
  for (uint node = gl_GlobalInvocationID.x; node < push.nodes; node += gl_NumWorkGroups.x * GROUP_SIZE) {
    uint pair = wide_nodes[node];
    find_members(pair);
    encode(node, pair);
  }
}
