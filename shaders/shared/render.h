// Push constants, bindings and records that the rendering kernels and the renderer share.
#ifndef BALLOT_RENDER_H
#define BALLOT_RENDER_H

#include "layout.h"

// The rays of a picture are ordered by tiles of TILE_SIZE^2 pixels: tiles row by row, pixels inside a tile in Morton
// order (Vinkler, section 3: "ray indices based on morton code"). Pixels of a tile that lie outside the picture get
// dead rays.
#define TILE_SIZE 32

// The workgroup size of the kernels under shaders/rays/, shade/, path/ and integrators/ that handle one ray, hit or
// pixel an invocation.
#define PASS_GROUP 64

// An entry of a pixel list: column and row in one word.
#define LISTED_PIXEL(x, y) ((x) | (y) << 16)

// Values of BALLOT_SHADING.
#define SHADING_EYELIGHT 0  // base colour times the cosine to the camera, plus emission
#define SHADING_NORMALS 1   // the shading normal as a colour
#define SHADING_ALBEDO 2    // base colour

// Values of BALLOT_ORIGIN, the origin offset policy: where secondary rays start. See
// engine/render/data/offset_policies.h.
#define ORIGIN_CONSTANT 0
#define ORIGIN_ULP 1
#define ORIGIN_PBRT 2
#define ORIGIN_PROVED 3
#define ORIGIN_BOUNDED 4

// Bindings of set 0 of the rendering kernels. Those of the scene's arrays, from BIND_UVS to BIND_TEXTURES and from
// BIND_INSTANCES on, are no bindings of traversal or query kernels, so that these can read surfaces too.
#define BIND_FILM 2
#define BIND_PRIMARY 6  // primary rays of a generator, which writes to BIND_RAYS
#define BIND_STARTS 7
#define BIND_IDS 8     // for rays that passed a transparent hit: the index of the original ray
#define BIND_COUNTS 9  // RayStats of the instrumented variant, as words
#define BIND_PIXELS 11
#define BIND_TOTALS 12
// BIND_UVS: texel buffer, two texels a triangle and coordinate set: (u0 v0 u1 v1), (u2 v2 0 0); only with textures.
#define BIND_UVS 13
#define BIND_TEXELS 14  // texel buffer of all mip maps; a texel holds two linear half RGBA texels
#define BIND_TEXTURES 15
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
// BIND_LISTED: the listed pixels, a LISTED_PIXEL each. Ray generators use it only where the picture cuts tiles.
#define BIND_LISTED 36
#define BIND_INSTANCES 37  // texel buffer of scenes with instances: lib/shade/triangles.glsl
#define PLACED_TEXELS 4
#define BIND_COLORS 38  // texel buffer of scenes with colours, two texels a triangle: half RGBA of vertices 0, 1 and 2
// BIND_TRIANGLES: texel buffer, three texels a triangle in the order of the scene's arrays: (v0.xyz, material),
// (v1.xyz, 0), (v2.xyz, 0).
#define BIND_TRIANGLES 39
#define BIND_NORMALS 40  // texel buffer, three texels a triangle; bound only if the scene has normals
#define BIND_MATERIALS 41
#define BIND_TEXTURE_USES 42
#define BIND_SKY 43       // texel buffer; lib/shade/sky.glsl
#define BIND_EMITTERS 44  // texel buffer of emissive triangles: (prim, running sum of weights, 0, 0)
#define BIND_LIGHTS 45

// Values of BALLOT_SKY: the numbers of Sky::Kind (engine/model/light.h).
#define SKY_NONE 0
#define SKY_CONSTANT 1
#define SKY_GRADIENT 2
#define SKY_MAP 3

// The roughness below which a surface reflects and refracts as a perfect mirror: one ray in, one ray out. The same as
// kMirrorRoughness.
#define MIRROR_ROUGHNESS 0.05

// Bits of GpuMaterial::flags.
#define MATERIAL_ALPHA_MASK 1u
#define MATERIAL_ALPHA_BLEND 2u
#define MATERIAL_UNLIT 4u
#define MATERIAL_LAMBERT 8u

// The slots of a material's texture uses, then the values of GpuTexture::flags.
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

// Values of GpuLight::kind.
#define LIGHT_POINT 0u
#define LIGHT_SPOT 1u
#define LIGHT_DIRECTIONAL 2u

#ifdef __cplusplus
namespace ballot {
#endif

// The camera of a dispatch, and the samples and pixels that it covers.
//
// Directions are sums of products, so every device makes the same rays: dir = corner + x * step_x + y * step_y, with
// (x, y) in pixels from the top left. An orthographic view moves the origin in the same way instead.
//
// The samples of a pixel are consecutive: ray i is sample sample_index + i % together of pixel i / together.
struct PrimaryPush {
  vec3 origin;
  uint width;
  vec3 corner;
  uint height;
  vec3 step_x;
  uint first;  // number of the first pixel; with a pixel list, its place in the list
  vec3 step_y;
  uint sample_index;  // of the first sample
  uint sample_count;  // samples a pixel in the whole picture; 1: through pixel centres; more: jittered
  uint orthographic;  // 1: orthographic; read only by variants for both kinds of cameras
  uint together;      // samples a pixel in this dispatch; 1 without a pixel list
  uint count;         // rays
  uint seed;          // of the random numbers of listed pixels; 0: the same numbers as without a seed
};

// The samples of listed pixels that a dispatch covers. Fields as in PrimaryPush.
struct SampleRange {
  uint first;
  uint together;
  uint sample_index;
  uint width;
  uint seed;
};

// Push constants of the secondary ray generators: `count` rays, starting at ray number `first` of a chunk of primary
// hits, go to the output at `offset`.
struct SecondaryPush {
  vec3 light;    // position of the point light
  float radius;  // t_max of ambient occlusion rays, scene units
  uint first;
  uint count;
  uint rays_per_hit;
  uint offset;
  float constant_offset;  // offset of policy "constant", scene units
  uint sample_index;      // in the picture; every sample has its own random numbers
};

// A primary ray that hit something: its index in its chunk, and its pixel (numbered row by row).
struct Start {
  uint ray;
  uint pixel;
};

// Push constants of shade.comp.
struct ShadePush {
  uint count;
};

// Push constants of samples.comp.
struct SamplesPush {
  PrimaryPush camera;             // the camera of these hits; a pixel has the same place in list and film
  float cone_width, cone_spread;  // lib/shade/shade_hit.glsl
  uint pixels;                    // pixels that these rays belong to
  uint lanes_log2;                // log2 of the lanes for a pixel, which are 4 to 64 on GPUs and 1 on a CPU
};

// Push constants of tiles.comp, which lists the pixels of whole tiles in ray order.
struct TilesPush {
  uint width;
  uint count;
};

// A material. See engine/model/material.h.
struct GpuMaterial {
  vec3 base_color;
  float alpha;
  vec3 emissive;
  // The luminance of emissive times the mean of its texture. Light sampling weights the area of a triangle with it.
  float emitted;
  float metallic;
  float roughness;
  float transmission;
  float ior;
  float alpha_cutoff;
  uint flags;
};

// A use of a texture by a material. See TextureUse in engine/model/material.h.
struct GpuTextureUse {
  uint texture;   // NO_TEXTURE if there is none
  uint first_uv;  // texel of BIND_UVS at which the coordinate set begins
  vec3 row_u;
  vec3 row_v;
  float scale;  // strength of a normal map
};

// A texture: where its mip maps lie, and how it is sampled.
struct GpuTexture {
  uint first;  // first texel of the finest level, in half texels of BIND_TEXELS; the other levels follow
  uint width, height;
  uint levels;
  uint flags;  // wrap mode of u, wrap mode of v << TEXTURE_WRAP_V_SHIFT, TEXTURE_NEAREST
};

// A punctual light (KHR_lights_punctual). See engine/model/light.h.
struct GpuLight {
  vec3 position;
  uint kind;
  vec3 direction;
  float range;
  vec3 intensity;
  float cos_inner;
  float cos_outer;
};

// The state of a path. It belongs to one sample of a pixel. Path i begins with camera ray i
// (lib/camera/pixel_samples.glsl).
struct Path {
  vec3 radiance;
  uint hit;  // 1: the camera ray hit something
};

// The path state that travels with a ray of a wave: its path, and the throughput of what the ray finds. The cone is the
// footprint of the ray (Akenine-Moeller et al., Texture Level of Detail Strategies for Real-Time Ray Tracing, Ray
// Tracing Gems, chapter 20, 2019).
struct Carried {
  vec3 throughput;
  uint path;
  float pdf;     // solid-angle density of the direction; 0 if light sampling cannot find it: camera rays, mirrors
  float width;   // width of the cone at the origin of the ray, scene units
  float spread;  // growth of the width for each unit of length
  uint unused;
};

// The radiance that an unoccluded shadow ray adds to its path.
struct ShadowPayload {
  vec3 radiance;
  uint path;
};

// The state of a path whose rays split at glass. The path follows the mirrored ray and everything that comes of it
// first; the refracted ray of each depth is deferred. A depth has at most one deferred ray, because a path works on one
// ray at a time.
struct Deferred {
  uint depth;      // depth of the current ray
  uint low, high;  // a bit for each depth with a deferred ray
};

// The ray counts of the queues that the kernels of a wave fill.
#define QUEUE_NEXT 0
#define QUEUE_SHADOW 1
#define QUEUE_PASSED 2  // rays that continue through transparent surfaces
#define QUEUES 3
struct Queues {
  uint next;
  uint shadow;
  uint passed;
};

// Push constants of indirect.comp, which turns queue counts into indirect arguments. A record holds the arguments of a
// traversal dispatch for every queue, then the arguments of a dispatch with one invocation a ray for every queue.
#define INDIRECT_RECORDS (2 * QUEUES)
struct CallPush {
  uint record;
  uint trace_rays[QUEUES];    // rays that one traversal workgroup takes
  uint trace_groups[QUEUES];  // the most traversal workgroups
};

// Push constants of the integrators (shaders/integrators/).
struct WavePush {
  uint args;        // entry of BIND_WAVE_INDIRECT with the ray count
  uint depth;       // path depth of these rays, 0 for camera rays; the number of the wave if paths defer rays
  uint last_depth;  // rays of this depth start only shadow rays
  float ao_radius;  // scene units
  float emitted;    // sum of the weights of BIND_EMITTERS
  uint emitters;
  uint lights;
  uint paths;           // capacity of a wave, in paths
  uint sky;             // 1: the scene has a sky
  uint made;            // 1: variants with BALLOT_MAKES_RAYS compute the camera rays instead of reading them
  uint camera;          // entry of BIND_CAMERAS that the camera rays belong to
  SampleRange samples;  // the samples of these paths
  float cone_width;     // footprint of a pixel at the camera, and its growth with distance
  float cone_spread;
};

// Push constants of alpha.comp.
struct AlphaPush {
  uint args;   // entry of BIND_WAVE_INDIRECT with the ray count
  uint first;  // 1: the rays are the wave itself; 0: they continued earlier and have ids and hits of their own
};

// Push constants of film.comp.
struct FilmPush {
  uint first;         // place of the first pixel in the film
  uint places;        // pixels of this wave
  uint samples;       // samples a pixel; path i * samples + s belongs to pixel i
  uint first_sample;  // number of the first sample
  float most;         // a sample whose largest component is above it is scaled down to it
};

// A film pixel of a chunk of rays, in ray order. color and alpha are sums over samples; z, normal and prim are those of
// the first sample.
struct FilmPixel {
  vec3 color;
  float alpha;
  float z;  // distance along the ray, scene units; 0 on a miss
  vec3 normal;
  uint prim;
};

#ifdef __cplusplus
BALLOT_RECORD(PrimaryPush, 84);
BALLOT_RECORD(SecondaryPush, 40);
BALLOT_RECORD(Start, 8);
BALLOT_RECORD(ShadePush, 4);
BALLOT_RECORD(SamplesPush, 100);
BALLOT_RECORD(TilesPush, 8);
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
BALLOT_RECORD(FilmPush, 20);
BALLOT_RECORD(FilmPixel, 36);
}  // namespace ballot
#endif
#endif  // BALLOT_RENDER_H
