#version 460
#extension GL_GOOGLE_include_directive : require
// Derives from the bounds: the axis of each bit of a Morton code, the grid of the codes, and the point that boxes are
// measured from. One invocation.
//
// The axes: Marek Vinkler, Jiri Bittner, Vlastimil Havran. Extended Morton Codes for High Performance Bounding Volume
// Hierarchy Construction. HPG 2017. A bit halves the cell along the axis on which the cell is longest, so flat scenes
// waste no bits. Their other extension, bits for the sizes of triangles, is left out.
#include "../lib/build/frame.glsl"

layout(push_constant, scalar) uniform Push { BuildPush push; };
layout(set = 0, binding = BIND_BUILD_STATE, scalar) buffer State { BuildState state; };
#include "../lib/build/order.glsl"
#include "../lib/build/origin.glsl"

const float SHORTEST = 1e-30;  // an axis of less extent has no bits
const uint MOST_BITS = 31u;    // of one axis

void main() {
  if (gl_GlobalInvocationID.x != 0u) return;
  vec3 lo = vec3(0.0), hi = vec3(0.0);
  if (state.proper > 0u) {
    lo = unordered(uvec3(state.lo[0], state.lo[1], state.lo[2]));
    hi = unordered(uvec3(state.hi[0], state.hi[1], state.hi[2]));
  }
  vec3 sides = hi - lo, left = sides;
  uvec3 bits = uvec3(0u);
  uint axes[4] = uint[4](0u, 0u, 0u, 0u);
  for (uint i = 0u; i < push.bits; ++i) {
    uint axis = left.x >= left.y && left.x >= left.z ? 0u : left.y >= left.z ? 1u : 2u;
    axes[i / 16u] |= axis << (i % 16u * 2u);
    if (++bits[axis] == MOST_BITS)
      left[axis] = -1.0;
    else
      left[axis] *= 0.5;
  }
  vec3 scale = vec3(0.0);
  for (int k = 0; k < 3; ++k)
    if (sides[k] > SHORTEST) scale[k] = min(uintBitsToFloat((127u + bits[k]) << 23) / sides[k], 3e38);
  state.corner = lo;
  state.longest = max(sides.x, max(sides.y, sides.z));
  state.scale = scale;
  state.bits_x = bits.x;
  state.bits_y = bits.y;
  state.bits_z = bits.z;
  state.axes = axes;
  state.origin = box_origin(lo, hi);
}
