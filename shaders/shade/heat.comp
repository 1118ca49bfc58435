#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Writes heat map colours of the instrumented variant's counters to the film, over what shading left there, and to the
// window's pixels.
#include "../shared/window.h"
#include "../lib/frame/records.glsl"
#include "../lib/shade/film.glsl"
#include "../lib/shade/display.glsl"

layout(local_size_x = PASS_GROUP) in;
layout(push_constant, scalar) uniform Push { HeatPush push; };
layout(set = 0, binding = BIND_COUNTS, scalar) readonly buffer Counts { uint words[]; };
RECORDS_INOUT(BIND_FILM, Film, film)
layout(set = 0, binding = BIND_PIXELS, scalar) writeonly buffer Pixels { uint pixels[]; };

float linear_of(float srgb) { return srgb <= 0.04045 ? srgb / 12.92 : pow((srgb + 0.055) / 1.055, 2.4); }

void main() {
  uint index = gl_GlobalInvocationID.x;
  uvec2 pixel = pixel_of(push.first + index, push.width);
  if (index >= push.count || pixel.x >= push.width || pixel.y >= push.height) return;
  uint record = index * push.words;
  float value = float(words[record + push.value]);
  if (push.over_a != ~0u) {
    uint over = words[record + push.over_a];
    if (push.over_b != ~0u) over += words[record + push.over_b];
    value = over == 0u ? 0.0 : value / float(over);
  }
  float at = clamp(value / push.top, 0.0, 1.0) * 4.0;
  int i = min(int(at), 3);
  vec3 c = mix(push.ramp[i], push.ramp[i + 1], at - float(i));
  vec3 color = vec3(linear_of(c.r), linear_of(c.g), linear_of(c.b));
  if (push.sample_index > 0u) color += uintBitsToFloat(film_part(index).xyz);
  film[index] = part_of(color, 0u);
  pixels[pixel.y * push.width + pixel.x] = pixel_word(color * push.scale);
}
