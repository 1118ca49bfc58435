// The first part of an integrator's kernel: extensions, push constants, buffers, and random numbers. An integrator is a
// file shaders/integrators/<name>.comp and a row of engine/render/path/integrators.h. Its kernel shades the hits of a
// wave of rays: it adds light to their paths and starts their secondary rays. Before this file it defines
//
//   STARTS_SHADOW   1: hits start shadow rays or ao rays; the path gets Started::light if such a ray hits nothing
//   STARTS_NEXT     1: hits start rays of the next path depth
//   STARTS_SECOND   1: a hit may start two of those, so that paths branch
//
// each an expression of BALLOT_HAS_*, BALLOT_SKY and HAS_LIGHT (lib/shade/lights.glsl) that agrees with the plan in the
// integrator's row. What is 0 has no code and no binding. A kernel that reads materials defines BSDF_FINDS_LIGHT too
// (direct_light.glsl). Between this file and main.glsl, which is the last, it defines
//
//   void shade_hit(inout Path path, PixelSample sampled, Ray ray, Hit hit, Carried c, inout Started started)
//                   adds the light of a hit to path.radiance, starts its secondary rays, and ends with
//                   RECORD_FIRST_HIT (first_hit.glsl)
//   vec3 sky_seen(vec3 dir, float pdf)
//                   the radiance of a ray that leaves the scene; only if there is a sky and the kernel reads materials
//
// direct_light.glsl and material_hit.glsl define both for integrators that shade materials.
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
#include "../../shared/render.h"
#include "../frame/records.glsl"
#include "../frame/compact_records.glsl"

#if !defined(BALLOT_MAKES_RAYS) || !defined(BALLOT_SKY) || !defined(BALLOT_HAS_MATERIALS)
#error a variant must give BALLOT_SKY, BALLOT_MAKES_RAYS and BALLOT_HAS_*: engine/render/path/integrators.cpp
#endif
#if !defined(STARTS_SHADOW) || !defined(STARTS_NEXT) || !defined(STARTS_SECOND)
#error an integrator must define STARTS_SHADOW, STARTS_NEXT and STARTS_SECOND: shaders/lib/path/kernel.glsl
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
#include "../camera/camera_samples.glsl"
#else
#include "../camera/pixel_samples.glsl"
#endif
#include "../origin/surface.glsl"
#include "../shade/surface_material.glsl"
#include "../shade/sky.glsl"
#if BALLOT_HAS_MATERIALS
#ifndef BSDF_FINDS_LIGHT
#error an integrator that reads materials must define BSDF_FINDS_LIGHT: shaders/lib/path/direct_light.glsl
#endif
#include "../shade/bsdf.glsl"
#include "../shade/lights.glsl"
#else
#define HAS_LIGHT 0
#include "../shade/hemisphere.glsl"
#endif

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

// The secondary rays that one hit starts.
struct Started {
  bool shadow, next, second;
  Ray shadow_ray, next_ray, second_ray;
  vec3 light;
  Carried next_carried, second_carried;
};

#if STARTS_SECOND
#include "deferred.glsl"
#else
#define RAY_DEPTH push.depth
#endif

const uint FIRST_DIMENSION = 8u, DIMENSIONS = 8u;

// Returns random number k of a hit, 0 to DIMENSIONS - 1.
float draw(PixelSample sampled, uint k) {
  return sample_one(sampled.number, sampled.sample_index, FIRST_DIMENSION + RAY_DEPTH * DIMENSIONS + k);
}
// Returns random numbers k and k + 1, stratified together.
vec2 draw2(PixelSample sampled, uint k) {
  return sample_pair(sampled.number, sampled.sample_index, FIRST_DIMENSION + RAY_DEPTH * DIMENSIONS + k);
}
