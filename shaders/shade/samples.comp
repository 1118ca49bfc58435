#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Shades hits of camera rays, several samples of every listed pixel, into the film. On GPUs the lanes of a pixel take
// its samples in turn, so that they read consecutive hits; then one lane for each channel sums up, in sample order. On
// CPU devices lanes read one by one anyway and would wait long for each other, so there a lane has a pixel for itself,
// and reads rays instead of computing them.
#include "../shared/render.h"
#include "../lib/frame/records.glsl"

#ifndef BALLOT_RAYS_READ
#error a variant must give BALLOT_RAYS_READ: 0, on GPUs; 1, on CPU devices
#endif

#if BALLOT_RAYS_READ
RECORDS_IN(BIND_RAYS, Rays, rays)
#else
layout(set = 0, binding = BIND_LISTED, scalar) readonly buffer Listed { uint listed[]; };
#include "../lib/camera/camera_samples.glsl"
#endif
#include "../lib/shade/shade_hit.glsl"

layout(local_size_x = PASS_GROUP) in;
layout(push_constant, scalar) uniform Push { SamplesPush push; };
RECORDS_IN(BIND_HITS, Hits, hits)
layout(set = 0, binding = BIND_FILM, scalar) buffer Film { FilmPixel film[]; };

FilmPixel shade_sample(uint pixel, uint s) {
  uint index = pixel * push.camera.together + s;
#if BALLOT_RAYS_READ
  Ray ray = get_ray(rays, index);
#else
  Ray ray = camera_ray_of(push.camera, pixel_sample(samples_of(push.camera), pixel, s));
#endif
  return shade_hit(ray, get_hit(hits, index), push.cone_width, push.cone_spread);
}

#if BALLOT_RAYS_READ
void main() {
  uint pixel = gl_GlobalInvocationID.x, place = push.camera.first + pixel;
  if (pixel >= push.pixels) return;
  bool begun = push.camera.sample_index > 0u;
  precise vec4 sum = begun ? vec4(film[place].color, film[place].alpha) : vec4(0.0);
  FilmPixel first;
  uint s = 0u;
  do {
    FilmPixel p = shade_sample(pixel, s);
    if (s == 0u) first = p;
    sum += vec4(p.color, p.alpha);
    ++s;
  } while (s < push.camera.together);
  if (begun) {
    film[place].color = sum.rgb;
    film[place].alpha = sum.a;
  } else {
    film[place] = FilmPixel(sum.rgb, sum.a, first.z, first.normal, first.prim);
  }
}
#else
const uint CHANNELS = 4u;
shared float channels[CHANNELS][gl_WorkGroupSize.x];

void main() {
  uint together = push.camera.together, lanes = 1u << push.lanes_log2, lane = gl_LocalInvocationIndex & (lanes - 1u);
  uint pixel = gl_GlobalInvocationID.x >> push.lanes_log2, place = push.camera.first + pixel,
       base = gl_LocalInvocationIndex - lane;
  bool begun = push.camera.sample_index > 0u, live = pixel < push.pixels, sums = live && lane < CHANNELS;
  precise float sum = 0.0;
  if (sums && begun) sum = lane < 3u ? film[place].color[lane] : film[place].alpha;
  for (uint s = 0u; s < together; s += lanes) {
    vec4 color = vec4(0.0);
    if (live && s + lane < together) {
      FilmPixel p = shade_sample(pixel, s + lane);
      color = vec4(p.color, p.alpha);
      if (!begun && s + lane == 0u) {
        film[place].z = p.z;
        film[place].normal = p.normal;
        film[place].prim = p.prim;
      }
    }
    for (uint c = 0u; c < CHANNELS; ++c) channels[c][gl_LocalInvocationIndex] = color[c];
    barrier();
    // Four at a time, so that the loads overlap.
    if (sums)
      for (uint i = base; i < base + lanes; i += 4u) {
        float a = channels[lane][i], b = channels[lane][i + 1u], c = channels[lane][i + 2u], d = channels[lane][i + 3u];
        sum += a;
        sum += b;
        sum += c;
        sum += d;
      }
    barrier();
  }
  if (!sums) return;
  if (lane < 3u)
    film[place].color[lane] = sum;
  else
    film[place].alpha = sum;
}
#endif
