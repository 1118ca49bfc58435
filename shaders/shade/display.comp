#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
// Converts film to the 8-bit pixels of a window, row by row, for pictures that more than one kernel makes: heat maps,
// and two films side by side with their differences marked.
#include "../shared/window.h"
#include "../lib/frame/records.glsl"
#include "../lib/shade/film.glsl"
#include "../lib/shade/display.glsl"

layout(local_size_x = PASS_GROUP) in;
layout(push_constant, scalar) uniform Push { DisplayPush push; };
RECORDS_IN(BIND_FILM, Film, film)
RECORDS_IN(BIND_FILM_B, FilmB, film_b)
layout(set = 0, binding = BIND_PIXELS, scalar) writeonly buffer Pixels { uint pixels[]; };
layout(set = 0, binding = BIND_TOTALS, scalar) buffer Totals { DisplayTotals totals; };

const vec3 kMark = vec3(1.0, 0.0, 1.0);

void main() {
  uint index = gl_GlobalInvocationID.x;
  uvec2 pixel = pixel_of(push.first + index, push.width);
  bool inside = index < push.count && pixel.x < push.width && pixel.y < push.height;
  bool different = false;
  if (inside) {
    uvec4 a = film_part(index), b = film_b_part(index);
    vec3 color = uintBitsToFloat(pixel.x >= push.split ? b.xyz : a.xyz) * push.scale;
    if (push.mark != 0u) {
      different = a.w != b.w;
      if (different) color = kMark;
      if (pixel.x == push.split) color = vec3(1.0);
    }
    pixels[pixel.y * push.width + pixel.x] = pixel_word(color, push.swap_red != 0u);
  }
  uint count = subgroupBallotBitCount(subgroupBallot(different));
  if (subgroupElect() && count != 0u) atomicAdd(totals.different, count);
}
