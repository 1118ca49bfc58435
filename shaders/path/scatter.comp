#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
// What the hits of a wave of rays give to their paths, and the rays that they start. A wave holds at most one ray of each path,
// so that sums have one order. Rays are put one behind the other: those of the next wave are as many as have something to find.
#include "../shared/render.h"
#include "../lib/records.glsl"
#include "../lib/put_records.glsl"
#include "../lib/random.glsl"

#ifndef BALLOT_INTEGRATOR
#error a variant must give BALLOT_INTEGRATOR, BALLOT_SKY and BALLOT_HAS_*: engine/render/scene_data.cpp
#endif

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { WavePush push; };
RECORDS_IN(BIND_RAYS, Rays, rays)
RECORDS_IN(BIND_HITS, Hits, hits)
RECORDS_IN(BIND_CARRIED, CarriedRays, carried)
RECORDS_INOUT(BIND_PATHS, Paths, paths)
layout(set = 0, binding = BIND_FILM, scalar) buffer Film { FilmPixel film[]; };
layout(set = 0, binding = BIND_QUEUES, scalar) buffer QueueCounts { Queues queues; };
layout(set = 0, binding = BIND_WAVE_CALLS, scalar) readonly buffer Calls { Call calls[]; };
#include "../lib/surface.glsl"
#include "../lib/look.glsl"
#include "../lib/sky.glsl"
#if BALLOT_INTEGRATOR == INTEGRATOR_AO
#define HAS_LIGHT 0
#include "../lib/hemisphere.glsl"
#else
#include "../lib/bsdf.glsl"
#include "../lib/lights.glsl"
#endif

#define STARTS_SHADOW (HAS_LIGHT || BALLOT_INTEGRATOR == INTEGRATOR_AO)
#define STARTS_NEXT (BALLOT_INTEGRATOR == INTEGRATOR_PATH || (BALLOT_INTEGRATOR == INTEGRATOR_WHITTED && BALLOT_HAS_GLOSS))
#define STARTS_SECOND (BALLOT_INTEGRATOR == INTEGRATOR_WHITTED && BALLOT_HAS_GLOSS && BALLOT_HAS_GLASS)

#if STARTS_SHADOW
RECORDS_OUT(BIND_SHADOW_RAYS, ShadowRays, shadow_rays)
RECORDS_OUT(BIND_SHADOW_LIGHT, ShadowLight, shadow_light)
#endif
#if STARTS_NEXT
RECORDS_OUT(BIND_NEXT_RAYS, NextRays, next_rays)
RECORDS_OUT(BIND_NEXT_CARRIED, NextCarried, next_carried)
#endif
#if STARTS_SECOND
RECORDS_INOUT(BIND_PUT_OFF_RAYS, PutOffRays, put_off_rays)
RECORDS_INOUT(BIND_PUT_OFF_CARRIED, PutOffCarried, put_off_carried)
layout(set = 0, binding = BIND_PUT_OFF, scalar) buffer PutOffs { PutOff put_off[]; };
#endif

// The place of the first of a subgroup's rays in a queue: one atomic operation.
#define APPEND(counter, wanted, first)                                            \
  {                                                                               \
    uvec4 who = subgroupBallot(wanted);                                           \
    if (subgroupElect()) first = atomicAdd(counter, subgroupBallotBitCount(who)); \
    first = subgroupBroadcastFirst(first);                                        \
  }

// What one hit starts.
struct Started {
  bool shadow, next, second;
  Ray shadow_ray, next_ray, second_ray;
  vec3 light;
  Carried next_carried, second_carried;
};

#if STARTS_SECOND
#include "../lib/put_off.glsl"
#else
#define RAY_DEPTH push.depth
#endif

const uint FIRST_DIMENSION = 8u, DIMENSIONS = 8u;

float draw(Path path, uint k) {
  return random_number(path.number, path.sample_index, FIRST_DIMENSION + RAY_DEPTH * DIMENSIONS + k);
}
vec2 draw2(Path path, uint k) { return vec2(draw(path, k), draw(path, k + 1u)); }

#if BALLOT_INTEGRATOR != INTEGRATOR_AO
#include "../lib/scatter.glsl"
#endif

void record_first(Path path, Ray ray, Hit hit, vec3 normal) {
  FilmPixel p = FilmPixel(vec3(0.0), 0.0, 0.0, vec3(0.0), NO_HIT);
  if (hit.prim != NO_HIT) {
    p.z = hit.t * length(ray.dir);
    p.normal = normal;
    p.prim = hit.prim;
  }
  film[path.place] = p;
}

// Adds to path.radiance what the hit itself shines with.
void shade_hit(inout Path path, Ray ray, Hit hit, Carried c, inout Started started) {
  Surface s = surface_of(ray, hit);
#if BALLOT_INTEGRATOR == INTEGRATOR_AO
  vec3 n = smooth_normal(hit, s.normal);
  vec3 to = cosine_about(n, draw2(path, 0u));
  started.shadow = dot(to, s.normal) > 0.0;
  started.shadow_ray = leave(s, 1.0, to, push.ao_radius);
  started.light = vec3(1.0);
#else
  float distance = hit.t * length(ray.dir), width = c.width + c.spread * distance;
  Look look = look_at(hit, material_of(hit.prim), s.v0, s.v1, s.v2, s.normal, s.front, s.dir, width);
  vec3 n = look.normal;
  scatter(path, s, look, c, distance, width, started);
#endif
  if (RAY_DEPTH == 0u) {
    path.hit = 1u;
    if (path.sample_index == 0u) record_first(path, ray, hit, n);
  }
}

void main() {
  uint index = gl_GlobalInvocationID.x;
  Started started;
  started.shadow = started.next = started.second = false;
  if (index < calls[push.call].count) {
    Carried c = get_carried(carried, index);
    Ray ray = get_ray(rays, index);
    Hit hit = get_hit(hits, index);
    Path path = get_path(paths, c.path);
    vec3 known = path.radiance;
#if STARTS_SECOND
    begin_ray(c.path);
#endif
    if (hit.prim != NO_HIT) {
      shade_hit(path, ray, hit, c, started);
    } else {
      if (RAY_DEPTH == 0u && path.sample_index == 0u) record_first(path, ray, hit, vec3(0.0));
#if BALLOT_SKY != SKY_NONE && BALLOT_INTEGRATOR != INTEGRATOR_AO
      path.radiance += c.throughput * sky_seen(normalize(ray.dir), c.pdf);
#endif
    }
    if (path.radiance != known) paths[2u * c.path] = first_part(path);
    if (RAY_DEPTH == 0u) paths[2u * c.path + 1u] = second_part(path);
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
  if (started.shadow) put_part(shadow_light, place, Awaited(started.light, started.next_carried.path));
#endif
#if STARTS_NEXT
  APPEND(queues.next, started.next, first)
  PUT_RECORDS(next_rays, first, started.next, started.next_ray)
  PUT_RECORDS(next_carried, first, started.next, started.next_carried)
#endif
}
