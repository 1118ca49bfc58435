// What the rendering kernels and the renderer share: push constants, bindings, records.
#ifndef BALLOT_RENDER_H
#define BALLOT_RENDER_H

#include "layout.h"

// Rays of a picture are ordered by tiles of TILE_SIZE^2 pixels, row by row, Morton order inside (Vinkler, section 3: "ray
// indices based on morton code"). Pixels of a tile outside the picture get dead rays.
#define TILE_SIZE 32

// BALLOT_SHADING
#define SHADING_EYELIGHT 0  // base colour times the cosine to the eye, plus emission
#define SHADING_NORMALS 1   // shading normal as colour

// BALLOT_ORIGIN: where rays from hits start; engine/render/offset_policies.h.
#define ORIGIN_CONSTANT 0
#define ORIGIN_ULP 1
#define ORIGIN_PBRT 2
#define ORIGIN_PROVED 3
#define ORIGIN_BOUNDED 4

// Bindings of set 0.
#define BIND_FILM 2
#define BIND_TRIANGLES 3  // texel buffer, three texels a triangle in prim order: (v0.xyz, material), (v1.xyz, 0), (v2.xyz, 0)
#define BIND_NORMALS 4    // texel buffer, three texels a triangle; only where the scene has normals
#define BIND_MATERIALS 5
#define BIND_PRIMARY 6  // primary rays, where BIND_RAYS is what a generator writes
#define BIND_STARTS 7
#define BIND_NUMBERS 8  // numbers of the rays that lie in the picture; only where the picture cuts tiles
#define BIND_COUNTS 9   // RayStats of the instrumented variant, as words
#define BIND_FILM_B 10  // of the second of two queries beside each other
#define BIND_PIXELS 11
#define BIND_TOTALS 12

#ifdef __cplusplus
namespace ballot {
#endif

// Directions are sums of products, so every device makes the same rays: dir = corner + x * step_x + y * step_y, with (x, y) in
// pixels from the top left. Orthographic views move the origin in the same way instead.
struct PrimaryPush {
  vec3 origin;
  uint width;
  vec3 corner;
  uint height;
  vec3 step_x;
  uint first;  // number of the first ray of this chunk
  vec3 step_y;
  uint sample_index;
  uint sample_count;  // 1: through pixel centres; more: jittered
  uint orthographic;
};

// Rays from primary hits: `count` of them, from ray number `first` of a chunk of primary hits, to `offset` of the output.
struct SecondaryPush {
  vec3 light;    // position of the point light
  float radius;  // t_max of ao rays, scene units
  uint first;
  uint count;
  uint rays_per_hit;
  uint offset;
  float constant_offset;  // of policy "constant", scene units
  uint sample_index;  // of the picture: every sample has random numbers of its own
};

// A primary ray that hit something: its index in its chunk, and its pixel (row by row).
struct Start {
  uint ray;
  uint pixel;
};

struct ShadePush {
  uint width, height;
  uint first;
  uint count;  // rays of this chunk
  uint sample_index;
};

// Colours of a heat map into the film.
struct HeatPush {
  uint width, height;
  uint first;
  uint count;
  uint sample_index;
  uint words;  // of a ray's record
  uint value;  // the word that is shown
  uint over_a, over_b;  // the words whose sum it is divided by; ~0: none
  float top;            // what the last colour stands for
  vec3 ramp[5];         // sRGB
};

// The film of a window's picture to 8-bit pixels.
struct DisplayPush {
  uint width, height;
  uint first;
  uint count;
  float scale;    // of the colours: one over the samples
  uint split;     // first column that shows the second film
  uint mark;      // 1: pixels whose prims differ are marked; 0: there is one film
  uint swap_red;  // 1: blue in the lowest byte
};

// Of all pixels of a picture.
struct DisplayTotals {
  uint live;       // rays that were alive
  uint different;  // pixels whose prims differ between the films
};

struct GpuMaterial {
  vec3 base_color;
  vec3 emissive;
};

// The film of a chunk of rays, in their order. Sums over samples, but for z, normal and prim, which are those of the first
// sample.
struct FilmPixel {
  vec3 color;
  float alpha;
  float z;  // distance along the ray, scene units; 0 on a miss
  vec3 normal;
  uint prim;
};

#ifdef __cplusplus
BALLOT_RECORD(PrimaryPush, 72);
BALLOT_RECORD(SecondaryPush, 40);
BALLOT_RECORD(Start, 8);
BALLOT_RECORD(ShadePush, 20);
BALLOT_RECORD(HeatPush, 100);
BALLOT_RECORD(DisplayPush, 32);
BALLOT_RECORD(DisplayTotals, 8);
BALLOT_RECORD(GpuMaterial, 24);
BALLOT_RECORD(FilmPixel, 36);
}  // namespace ballot
#endif
#endif  // BALLOT_RENDER_H
