#version 460
#extension GL_GOOGLE_include_directive : require
// Writes the Morton code of each triangle: of the centre of its box, on the grid of frame.comp. Triangles without area
// get the last key, so that they lie behind all others when sorted.
#include "../lib/build/frame.glsl"
#include "../lib/build/keys.glsl"

layout(push_constant, scalar) uniform Push { BuildPush push; };
layout(set = 0, binding = BIND_BUILD_STATE, scalar) readonly buffer State { BuildState state; };
layout(set = 0, binding = BIND_BUILD_KEYS_OUT, std430) writeonly buffer Keys { Key keys[]; };
#include "../lib/build/triangles.glsl"

// Returns a coordinate on the grid, with its highest bit on top of the word.
uint step_of(float x, float scale, uint bits) {
  if (bits == 0u) return 0u;
  return min(uint(max(x * scale, 0.0)), (1u << bits) - 1u) << (32u - bits);
}

Key code_of(Corners t) {
  vec3 at = (0.5 * lo_of(t) + 0.5 * hi_of(t)) - state.corner;
  uint x = step_of(at.x, state.scale.x, state.bits_x), y = step_of(at.y, state.scale.y, state.bits_y),
       z = step_of(at.z, state.scale.z, state.bits_z);
  Key code = Key(0u);
  uint axes = 0u;
  for (uint i = 0u; i < push.bits; ++i) {
    if (i % 16u == 0u) axes = state.axes[i / 16u];
    uint axis = axes & 3u;
    axes >>= 2;
    uint bit = axis == 0u ? x : axis == 1u ? y : z;
    if (axis == 0u) x <<= 1;
    if (axis == 1u) y <<= 1;
    if (axis == 2u) z <<= 1;
    code = code_with_bit(code, bit >> 31);
  }
  return code == last_code(push.bits) ? code_before(code) : code;
}

void main() {
  for (uint i = gl_GlobalInvocationID.x; i < push.triangles; i += gl_NumWorkGroups.x * GROUP_SIZE) {
    Corners t = corners_of(i);
    Key key = NO_CODE;
    if (!has_no_area(t)) key = code_of(t);
    keys[i] = key;
  }
}
