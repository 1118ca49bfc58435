// Writes shaded hits to the film of a window (LivePixel) and to the window's pixels. Needs GL_KHR_shader_subgroup_basic
// and _ballot.
#include "display.glsl"

layout(local_size_x = PASS_GROUP) in;
layout(push_constant, scalar) uniform Push { LivePush push; };
RECORDS_INOUT(BIND_FILM, Film, film)
layout(set = 0, binding = BIND_PIXELS, scalar) writeonly buffer Pixels { uint pixels[]; };
layout(set = 0, binding = BIND_TOTALS, scalar) buffer Totals { uint live_rays; };

bool is_inside(uint index, uvec2 pixel) {
  return index < push.camera.count && pixel.x < push.camera.width && pixel.y < push.camera.height;
}

void put_live(uint index, uvec2 pixel, vec3 color) {
  if (push.camera.sample_index > 0u) color += uintBitsToFloat(film_part(index).xyz);
  film[index] = part_of(color, 0u);
  if ((push.flags & LIVE_SHOWN) != 0u)
    pixels[pixel.y * push.camera.width + pixel.x] = pixel_word(color * push.scale);
}

// Counts the live rays. All lanes must call it.
void count_live(bool live) {
  if ((push.flags & LIVE_COUNTED) == 0u) return;
  uint count = subgroupBallotBitCount(subgroupBallot(live));
  if (subgroupElect()) atomicAdd(live_rays, count);
}
