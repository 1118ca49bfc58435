#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
// Film to the 8-bit pixels of a window, row by row: one film, or two beside each other with their differences marked.
#include "../shared/render.h"
#include "../lib/film.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { DisplayPush push; };
layout(set = 0, binding = BIND_RAYS, scalar) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = BIND_FILM, scalar) readonly buffer Film { FilmPixel film[]; };
layout(set = 0, binding = BIND_FILM_B, scalar) readonly buffer FilmB { FilmPixel film_b[]; };
layout(set = 0, binding = BIND_PIXELS, scalar) writeonly buffer Pixels { uint pixels[]; };
layout(set = 0, binding = BIND_TOTALS, scalar) buffer Totals { DisplayTotals totals; };

const vec3 kMark = vec3(1.0, 0.0, 1.0);

float srgb_of(float x) {
  x = clamp(x, 0.0, 1.0);
  return x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1.0 / 2.4) - 0.055;
}

void main() {
  uint index = gl_GlobalInvocationID.x;
  uvec2 pixel = pixel_of(push.first + index, push.width);
  bool inside = index < push.count && pixel.x < push.width && pixel.y < push.height;
  bool live = false, different = false;
  if (inside) {
    live = rays[index].t_max > 0.0;
    bool second = pixel.x >= push.split;
    vec3 color = (second ? film_b[index].color : film[index].color) * push.scale;
    color = vec3(srgb_of(color.r), srgb_of(color.g), srgb_of(color.b));
    if (push.mark != 0u) {
      different = film[index].prim != film_b[index].prim;
      if (different) color = kMark;
      if (pixel.x == push.split) color = vec3(1.0);
    }
    if (push.swap_red != 0u) color = color.bgr;
    pixels[pixel.y * push.width + pixel.x] = packUnorm4x8(vec4(color, 1.0));
  }
  uint live_count = subgroupBallotBitCount(subgroupBallot(live));
  uint different_count = subgroupBallotBitCount(subgroupBallot(different));
  if (subgroupElect()) {
    atomicAdd(totals.live, live_count);
    if (different_count != 0u) atomicAdd(totals.different, different_count);
  }
}
