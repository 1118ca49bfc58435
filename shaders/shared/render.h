// What the rendering kernels and the renderer share: push constants, bindings, records.
#ifndef BALLOT_RENDER_H
#define BALLOT_RENDER_H

#include "layout.h"

// Rays of a picture are ordered by tiles of TILE_SIZE^2 pixels, row by row, Morton order inside (Vinkler, section 3: "ray
// indices based on morton code"). Pixels of a tile outside the picture get dead rays.
#define TILE_SIZE 32

// A pixel in a list, by column and row.
#define LISTED_PIXEL(x, y) ((x) | (y) << 16)

// BALLOT_SHADING
#define SHADING_EYELIGHT 0  // base colour times the cosine to the eye, plus emission
#define SHADING_NORMALS 1   // shading normal as colour

// BALLOT_ORIGIN: where rays from hits start; engine/render/batch/offset_policies.h.
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
#define BIND_IDS 8  // of rays that went on behind what is transparent: where they came from
#define BIND_COUNTS 9   // RayStats of the instrumented variant, as words
#define BIND_FILM_B 10  // of the second of two queries beside each other
#define BIND_PIXELS 11
#define BIND_TOTALS 12
#define BIND_UVS 13  // texel buffer, two texels a triangle and set: (u0 v0 u1 v1), (u2 v2 0 0); only where textures are
#define BIND_TEXELS 14  // texel buffer of all mip maps, two linear half RGBA texels each
#define BIND_TEXTURES 15
#define BIND_TEXTURE_USES 16
#define BIND_SKY 17  // texel buffer, SKY_* below
#define BIND_EMITTERS 18  // texel buffer: (prim, sum of weights up to it, 0, 0) of each triangle that emits
#define BIND_LIGHTS 19
#define BIND_PATHS 20
#define BIND_CARRIED 21
#define BIND_NEXT_RAYS 22
#define BIND_NEXT_CARRIED 23
#define BIND_DEFERRED_RAYS 24
#define BIND_DEFERRED_CARRIED 25
#define BIND_SHADOW_RAYS 26
#define BIND_SHADOW_LIGHT 27
#define BIND_QUEUES 28
#define BIND_MOMENTS 29
#define BIND_NEXT_IDS 30
#define BIND_WAVE_HITS 31
#define BIND_DEFERRED 32
#define BIND_WAVE_INDIRECT 33
#define BIND_REPORTS 34
#define BIND_CAMERAS 35  // PrimaryPush of each part of a picture
#define BIND_LISTED 36   // pixels, LISTED_PIXEL of each; of generators only where the picture cuts tiles

// BALLOT_INTEGRATOR: what a hit starts.
#define INTEGRATOR_AO 0       // a short ray that asks whether the surface is open
#define INTEGRATOR_WHITTED 1  // a ray to a light, and the mirrored and the refracted ray
#define INTEGRATOR_PATH 2     // a ray to a light, and one ray by chance

// BALLOT_SKY: numbers of Sky::Kind (engine/scene/light.h).
#define SKY_NONE 0
#define SKY_CONSTANT 1
#define SKY_GRADIENT 2
#define SKY_MAP 3

#define MIRROR_ROUGHNESS 0.05  // below it a surface reflects and refracts one ray as one ray; kMirrorRoughness

// GpuMaterial::flags.
#define MATERIAL_ALPHA_MASK 1u
#define MATERIAL_ALPHA_BLEND 2u
#define MATERIAL_UNLIT 4u
#define MATERIAL_LAMBERT 8u

// Places of a material's texture uses, and GpuTexture::flags.
#define USE_BASE 0u
#define USE_SURFACE 1u
#define USE_EMISSIVE 2u
#define USE_NORMAL 3u
#define USES_PER_MATERIAL 4u
#define WRAP_REPEAT 0u
#define WRAP_CLAMP 1u
#define WRAP_MIRROR 2u
#define TEXTURE_WRAP_V_SHIFT 2
#define TEXTURE_NEAREST 16u
#define NO_TEXTURE 0xFFFFFFFFu

// GpuLight::kind.
#define LIGHT_POINT 0u
#define LIGHT_SPOT 1u
#define LIGHT_DIRECTIONAL 2u

#ifdef __cplusplus
namespace ballot {
#endif

// Directions are sums of products, so every device makes the same rays: dir = corner + x * step_x + y * step_y, with (x, y) in
// pixels from the top left. Orthographic views move the origin in the same way instead.
//
// The samples of a pixel lie one behind the other: ray i is sample sample_index + i % together of pixel i / together.
struct PrimaryPush {
  vec3 origin;
  uint width;
  vec3 corner;
  uint height;
  vec3 step_x;
  uint first;  // number of the first pixel, or where pixels are listed its place in the list
  vec3 step_y;
  uint sample_index;  // the first
  uint sample_count;  // of the picture; 1: through pixel centres; more: jittered
  uint orthographic;  // of variants for both kinds of cameras
  uint together;      // samples of a pixel; 1 where pixels are not listed
  uint count;         // rays
  uint seed;          // of the random numbers of listed pixels; 0: those of a picture without
};

// Which samples of listed pixels are at hand, as PrimaryPush says.
struct SampleRange {
  uint first;
  uint together;
  uint sample_index;
  uint width;
  uint seed;
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
  uint count;
};

struct SamplesPush {
  PrimaryPush camera;  // whose rays these hits are of; a pixel's place in the list is that in the film
  float cone_width, cone_spread;
  uint pixels;      // of these rays
  uint lanes_log2;  // lanes of a pixel: 4 to 64 on GPUs, 1 on a CPU
};

// A list of the pixels of whole tiles, in the order of rays.
struct TilesPush {
  uint width;
  uint count;
};

// LivePush::flags.
#define LIVE_SHOWN 1u     // pixels of the window are written too: nothing but this film is shown
#define LIVE_SWAP_RED 2u  // of these, with blue in the lowest byte
#define LIVE_COUNTED 4u   // rays that were alive are

// Hits to the film of a window's picture.
struct LivePush {
  PrimaryPush camera;  // whose pixels these are; sample_index 0 begins the film
  float cone_width, cone_spread;  // lib/shade/shade_hit.glsl
  float scale;                    // of colours that are shown: one over the samples
  uint flags;
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
  uint live;       // rays that were alive, where they were counted
  uint different;  // pixels whose prims differ between the films
};

struct GpuMaterial {
  vec3 base_color;
  float alpha;
  vec3 emissive;
  float emitted;  // luminance of emissive, times its texture's mean: how much triangles of it are aimed at, by area
  float metallic;
  float roughness;
  float transmission;
  float ior;
  float alpha_cutoff;
  uint flags;
};

// engine/scene/material.h, TextureUse.
struct GpuTextureUse {
  uint texture;    // NO_TEXTURE: none
  uint first_uv;   // texel of BIND_UVS at which the set begins
  vec3 row_u;
  vec3 row_v;
  float scale;     // of a normal map
};

struct GpuTexture {
  uint first;  // texel of the finest level, counted in halves of BIND_TEXELS; the others follow
  uint width, height;
  uint levels;
  uint flags;  // how u is wrapped, v's shifted, and TEXTURE_NEAREST
};

// KHR_lights_punctual; engine/scene/light.h.
struct GpuLight {
  vec3 position;
  uint kind;
  vec3 direction;
  float range;
  vec3 intensity;
  float cos_inner;
  float cos_outer;
};

// A path from a sample of a pixel, while it grows: path i begins with ray i of a camera (lib/camera/pixel_samples.glsl).
struct Path {
  vec3 radiance;
  uint hit;  // 1: its camera ray met something
};

// What goes with a ray of a wave: whose path it is, and how much of what it finds counts.
struct Carried {
  vec3 throughput;
  uint path;
  float pdf;     // of its direction, by solid angle; 0: no light could have aimed there, as at the eye and off mirrors
  float width;   // of the cone that it stands for, at its origin, scene units (Akenine-Moeller et al., Texture Level of
  float spread;  // Detail Strategies for Real-Time Ray Tracing, Ray Tracing Gems, chapter 20, 2019), and per unit of length
  uint unused;
};

// What a ray to a light brings if it meets nothing.
struct ShadowPayload {
  vec3 radiance;
  uint path;
};

// Where a path stands whose rays part: it follows the mirrored ray first, with all that comes of it, and the refracted one of
// each depth is put off. One is at most, as a path is at one ray at a time.
struct Deferred {
  uint depth;      // of the ray at hand
  uint low, high;  // a bit for each depth whose refracted ray waits
};

// How many rays the kernels of a wave have put where.
#define QUEUE_NEXT 0
#define QUEUE_SHADOW 1
#define QUEUE_PASSED 2  // rays that go on through what is transparent
#define QUEUES 3
struct Queues {
  uint next;
  uint shadow;
  uint passed;
};

// From what queues hold to the calls of those who take it. A record holds a call of the tracer for every queue, then one of
// kernels of a ray an invocation.
#define INDIRECT_RECORDS (2 * QUEUES)
struct CallPush {
  uint record;
  uint trace_rays[QUEUES];    // that a workgroup of the tracer takes
  uint trace_groups[QUEUES];  // at most
};

struct WavePush {
  uint args;
  uint depth;       // of these rays: 0 at the eye; where paths put rays off, the number of the wave
  uint last_depth;  // rays of this depth start none but to lights
  float ao_radius;  // scene units
  float emitted;    // sum of the weights of BIND_EMITTERS
  uint emitters;
  uint lights;
  uint paths;       // that a wave has room for
  uint sky;         // 1: the scene has one
  uint made;        // 1: the eye's rays are not read but made, by variants with BALLOT_MAKES_RAYS
  uint camera;      // of BIND_CAMERAS, whose rays those are
  SampleRange samples;  // whose paths these are
  float cone_width;   // what a pixel sees at the eye, and how much wider with distance
  float cone_spread;
};

struct AlphaPush {
  uint args;
  uint first;  // 1: of the wave itself; 0: of rays that went on, numbers and hits of theirs
};

struct FilmPush {
  uint first;    // place in the film
  uint places;   // pixels of this wave
  uint samples;  // of each; path i * samples + s is of pixel i
  uint first_sample;
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

// The film of a window's picture, in the order of rays.
struct LivePixel {
  vec3 color;  // the sum over samples
  uint prim;   // of the first one
};

#ifdef __cplusplus
BALLOT_RECORD(PrimaryPush, 84);
BALLOT_RECORD(SecondaryPush, 40);
BALLOT_RECORD(Start, 8);
BALLOT_RECORD(ShadePush, 4);
BALLOT_RECORD(SamplesPush, 100);
BALLOT_RECORD(TilesPush, 8);
BALLOT_RECORD(LivePush, 100);
BALLOT_RECORD(HeatPush, 100);
BALLOT_RECORD(DisplayPush, 32);
BALLOT_RECORD(DisplayTotals, 8);
BALLOT_RECORD(GpuMaterial, 56);
BALLOT_RECORD(GpuTextureUse, 36);
BALLOT_RECORD(GpuTexture, 20);
BALLOT_RECORD(GpuLight, 52);
BALLOT_RECORD(Path, 16);
BALLOT_RECORD(Carried, 32);
BALLOT_RECORD(ShadowPayload, 16);
BALLOT_RECORD(Deferred, 12);
BALLOT_RECORD(Queues, 12);
BALLOT_RECORD(CallPush, 28);
BALLOT_RECORD(WavePush, 72);
BALLOT_RECORD(SampleRange, 20);
BALLOT_RECORD(AlphaPush, 8);
BALLOT_RECORD(FilmPush, 16);
BALLOT_RECORD(FilmPixel, 36);
BALLOT_RECORD(LivePixel, 16);
}  // namespace ballot
#endif
#endif  // BALLOT_RENDER_H
