#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Converts the film of an integrator to the 8-bit pixels of a window, as a PNG of the same picture has them.
#include "../shared/window.h"
#include "../lib/shade/display.glsl"
#include "../lib/shade/tone.glsl"

layout(local_size_x = PASS_GROUP) in;
layout(push_constant, scalar) uniform Push { ShowPush push; };
layout(set = 0, binding = BIND_LISTED, scalar) readonly buffer Listed { uint listed[]; };
layout(set = 0, binding = BIND_FILM, scalar) readonly buffer Film { FilmPixel film[]; };
layout(set = 0, binding = BIND_PIXELS, scalar) writeonly buffer Pixels { uint pixels[]; };

void main() {
  uint place = gl_GlobalInvocationID.x;
  if (place >= push.count) return;
  uint x = listed[place] & 0xffffu, y = listed[place] >> 16;
  vec3 color = max(film[place].color * push.scale, vec3(0.0));
  if (push.neutral != 0u) color = neutral_tone(color);
  pixels[y * push.width + x] = pixel_word(color);
}
