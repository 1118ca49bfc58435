#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Camera rays of listed pixels, several samples of each, and the paths that begin with them.
#include "../shared/render.h"
#include "../lib/film.glsl"
#include "../lib/random.glsl"
#include "../lib/camera.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { BeginPush push; };
layout(set = 0, binding = BIND_RAYS, scalar) writeonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = BIND_CARRIED, scalar) writeonly buffer CarriedRays { Carried carried[]; };
layout(set = 0, binding = BIND_PATHS, scalar) writeonly buffer Paths { Path paths[]; };
layout(set = 0, binding = BIND_NUMBERS, scalar) readonly buffer Numbers { uint numbers[]; };

void main() {
  uint path = gl_GlobalInvocationID.x;
  if (path >= push.count) return;
  uint place = path % push.places, sample_index = push.first_sample + path / push.places;
  uvec2 pixel = pixel_of(numbers[place], push.camera.width);
  uint number = pixel.y * push.camera.width + pixel.x;
  if (push.seed != 0u) number += hash_word(push.seed);
  rays[path] = camera_ray(push.camera, pixel, number, sample_index);
  carried[path] = Carried(vec3(1.0), path, 0.0, push.cone_width, push.cone_spread);
  paths[path] = Path(vec3(0.0), number, sample_index, place, 0u);
}
