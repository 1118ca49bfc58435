#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
// Shades the hits of a wave of rays: adds light to their paths and starts their secondary rays. A wave holds at most
// one ray of each path, so the sums of a path have one order. New rays are written without gaps: the next wave has as
// many rays as are still needed.
#include "../shared/render.h"
#include "../lib/frame/records.glsl"
#include "../lib/frame/compact_records.glsl"

#if !defined(BALLOT_INTEGRATOR) || !defined(BALLOT_MAKES_RAYS)
#error a variant must give BALLOT_INTEGRATOR, BALLOT_SKY, BALLOT_MAKES_RAYS and BALLOT_HAS_*: \
    engine/render/path/integrators.cpp
#endif

layout(local_size_x = PASS_GROUP) in;
layout(push_constant, scalar) uniform Push { WavePush push; };
RECORDS_IN(BIND_RAYS, Rays, rays)
RECORDS_IN(BIND_HITS, Hits, hits)
layout(set = 0, binding = BIND_FILM, scalar) buffer Film { FilmPixel film[]; };
layout(set = 0, binding = BIND_QUEUES, scalar) buffer QueueCounts { Queues queues; };
layout(set = 0, binding = BIND_WAVE_INDIRECT, scalar) readonly buffer Indirect { IndirectArgs indirect[]; };
layout(set = 0, binding = BIND_LISTED, scalar) readonly buffer Listed { uint listed[]; };
#if BALLOT_MAKES_RAYS
layout(set = 0, binding = BIND_CAMERAS, scalar) readonly buffer Cameras { PrimaryPush cameras[]; };
#include "../lib/camera/camera_samples.glsl"
#else
#include "../lib/camera/pixel_samples.glsl"
#endif
#include "../lib/origin/surface.glsl"
#include "../lib/shade/surface_material.glsl"
#include "../lib/shade/sky.glsl"
#if BALLOT_INTEGRATOR == INTEGRATOR_AO
#define HAS_LIGHT 0
#include "../lib/shade/hemisphere.glsl"
#else
#include "../lib/shade/bsdf.glsl"
#include "../lib/shade/lights.glsl"
#endif

#define STARTS_SHADOW (HAS_LIGHT || BALLOT_INTEGRATOR == INTEGRATOR_AO)
#define STARTS_NEXT \
  (BALLOT_INTEGRATOR == INTEGRATOR_PATH || (BALLOT_INTEGRATOR == INTEGRATOR_WHITTED && BALLOT_HAS_GLOSS))
#define STARTS_SECOND (BALLOT_INTEGRATOR == INTEGRATOR_WHITTED && BALLOT_HAS_GLOSS && BALLOT_HAS_GLASS)

// Paths that end at their first hit are only written, never read.
#if STARTS_NEXT
RECORDS_IN(BIND_CARRIED, CarriedRays, carried)
RECORDS_INOUT(BIND_PATHS, Paths, paths)
#else
RECORDS_OUT(BIND_PATHS, Paths, paths)
#endif
#if STARTS_SHADOW
RECORDS_OUT(BIND_SHADOW_RAYS, ShadowRays, shadow_rays)
RECORDS_OUT(BIND_SHADOW_LIGHT, ShadowLight, shadow_payload)
#endif
#if STARTS_NEXT
RECORDS_OUT(BIND_NEXT_RAYS, NextRays, next_rays)
RECORDS_OUT(BIND_NEXT_CARRIED, NextCarried, next_carried)
#endif
#if STARTS_SECOND
RECORDS_INOUT(BIND_DEFERRED_RAYS, DeferredRays, deferred_rays)
RECORDS_INOUT(BIND_DEFERRED_CARRIED, DeferredCarried, deferred_carried)
layout(set = 0, binding = BIND_DEFERRED, scalar) buffer Deferreds { Deferred deferred[]; };
#endif

// Reserves places in a queue for the rays of a subgroup, with one atomic operation. `first` is the place of the first
// ray.
#define APPEND(counter, wanted, first)                                            \
  {                                                                               \
    uvec4 who = subgroupBallot(wanted);                                           \
    if (subgroupElect()) first = atomicAdd(counter, subgroupBallotBitCount(who)); \
    first = subgroupBroadcastFirst(first);                                        \
  }

// The secondary rays that one hit starts.
struct Started {
  bool shadow, next, second;
  Ray shadow_ray, next_ray, second_ray;
  vec3 light;
  Carried next_carried, second_carried;
};

#if STARTS_SECOND
#include "../lib/shade/deferred.glsl"
#else
#define RAY_DEPTH push.depth
#endif

const uint FIRST_DIMENSION = 8u, DIMENSIONS = 8u;

float draw(PixelSample sampled, uint k) {
  return random_number(sampled.number, sampled.sample_index, FIRST_DIMENSION + RAY_DEPTH * DIMENSIONS + k);
}
vec2 draw2(PixelSample sampled, uint k) { return vec2(draw(sampled, k), draw(sampled, k + 1u)); }

#if BALLOT_INTEGRATOR != INTEGRATOR_AO
#include "../lib/shade/scatter.glsl"
#endif

// Writes distance, normal and prim of the first sample to the film.
void record_first(PixelSample sampled, Ray ray, Hit hit, vec3 normal) {
  FilmPixel p = FilmPixel(vec3(0.0), 0.0, 0.0, vec3(0.0), NO_HIT);
  if (hit.prim != NO_HIT) {
    p.z = hit.t * length(ray.dir);
    p.normal = normal;
    p.prim = hit.prim;
  }
  film[sampled.place] = p;
}

// Shades a hit: adds its emission to path.radiance and starts its secondary rays.
void shade_hit(inout Path path, PixelSample sampled, Ray ray, Hit hit, Carried c, inout Started started) {
  Surface s = surface_of(ray, hit);
#if BALLOT_INTEGRATOR == INTEGRATOR_AO
  vec3 n = smooth_normal(hit, s.normal);
  vec3 to = cosine_about(n, draw2(sampled, 0u));
  started.shadow = dot(to, s.normal) > 0.0;
  started.shadow_ray = leave(s, 1.0, to, push.ao_radius);
  started.light = vec3(1.0);
#else
  float distance = hit.t * length(ray.dir), width = c.width + c.spread * distance;
  Look look = look_at(hit, material_of(hit.prim), s.v0, s.v1, s.v2, s.normal, s.front, s.dir, width);
  vec3 n = look.normal;
  scatter(path, sampled, s, look, c, distance, width, started);
#endif
  if (RAY_DEPTH == 0u) {
    path.hit = 1u;
    if (sampled.sample_index == 0u) record_first(sampled, ray, hit, n);
  }
}

// Returns the state of a path that begins at the camera.
Carried carried_at_eye(uint path) { return Carried(vec3(1.0), path, 0.0, push.cone_width, push.cone_spread, 0u); }

// Reads the ray of this invocation, or computes it if it is a camera ray that need not be stored.
Ray ray_at_hand(uint index, PixelSample sampled) {
#if BALLOT_MAKES_RAYS
  if (push.made != 0u) return camera_ray_of(cameras[push.camera], sampled);
#endif
  return get_ray(rays, index);
}

// Returns the sample that a path belongs to. The division is done in float, because CPU devices divide integers lane by
// lane. A wave has at most 2^24 paths, which floats hold exactly, so only the quotient is rounded. The quotient is a
// pixel number below 2^22, so Vulkan's 2.5 ulp are less than 1.
PixelSample sample_of_path(uint path) {
  uint together = push.samples.together, i = uint(float(path) / float(together));
  if (i * together > path) --i;
  if (path - i * together >= together) ++i;
  return pixel_sample(push.samples, i, path - i * together);
}

void main() {
  uint index = gl_GlobalInvocationID.x;
  Started started;
  started.shadow = started.next = started.second = false;
  if (index < indirect[push.args].count) {
    bool begins = push.depth == 0u;  // ray i belongs to path i then
    Carried c = carried_at_eye(index);
    Path path = Path(vec3(0.0), 0u);
#if STARTS_NEXT
    if (!begins) {
      c = get_carried(carried, index);
      path = get_path(paths, c.path);
    }
#endif
    PixelSample sampled = sample_of_path(c.path);
    Ray ray = ray_at_hand(index, sampled);
    Hit hit = get_hit(hits, index);
    vec3 known = path.radiance;
#if STARTS_SECOND
    begin_ray(c.path);
#endif
    if (hit.prim != NO_HIT) {
      shade_hit(path, sampled, ray, hit, c, started);
    } else {
      if (RAY_DEPTH == 0u && sampled.sample_index == 0u) record_first(sampled, ray, hit, vec3(0.0));
#if BALLOT_SKY != SKY_NONE && BALLOT_INTEGRATOR != INTEGRATOR_AO
      path.radiance += c.throughput * sky_seen(normalize(ray.dir), c.pdf);
#endif
    }
    if (begins || path.radiance != known) put_part(paths, c.path, path);
    started.next_carried.path = started.second_carried.path = c.path;
#if STARTS_SECOND
    choose_next(c.path, started);
#endif
  }
  uint first = 0u;
#if STARTS_SHADOW
  APPEND(queues.shadow, started.shadow, first)
  PUT_RECORDS(shadow_rays, first, started.shadow, started.shadow_ray)
  uint place = first + subgroupBallotExclusiveBitCount(subgroupBallot(started.shadow));
  if (started.shadow) put_part(shadow_payload, place, ShadowPayload(started.light, started.next_carried.path));
#endif
#if STARTS_NEXT
  APPEND(queues.next, started.next, first)
  PUT_RECORDS(next_rays, first, started.next, started.next_ray)
  PUT_RECORDS(next_carried, first, started.next, started.next_carried)
#endif
}
