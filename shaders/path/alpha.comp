#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
// Lets rays pass transparent hits: such a ray goes on behind the surface and is traced again. Runs only for scenes with
// alpha.
//
// Whether a blended surface stops a ray depends on a random number that is hashed from the ray's bits and the triangle,
// so every traversal method gets the same answer. Surfaces at the same distance count as one.
#include "../shared/render.h"
#include "../lib/frame/records.glsl"
#include "../lib/frame/compact_records.glsl"
#include "../lib/shade/random.glsl"

layout(local_size_x = PASS_GROUP) in;
layout(push_constant, scalar) uniform Push { AlphaPush push; };
RECORDS_IN(BIND_RAYS, Rays, rays)
RECORDS_IN(BIND_HITS, Hits, hits)
RECORDS_OUT(BIND_WAVE_HITS, WaveHits, wave_hits)
layout(set = 0, binding = BIND_IDS, scalar) readonly buffer Ids { uint ids[]; };
RECORDS_OUT(BIND_NEXT_RAYS, NextRays, next_rays)
layout(set = 0, binding = BIND_NEXT_IDS, scalar) writeonly buffer NextIds { uint next_ids[]; };
layout(set = 0, binding = BIND_QUEUES, scalar) buffer QueueCounts { Queues queues; };
layout(set = 0, binding = BIND_WAVE_INDIRECT, scalar) readonly buffer Indirect { IndirectArgs indirect[]; };
#include "../lib/shade/triangles.glsl"
#include "../lib/shade/surface_material.glsl"

// Returns a random number in [0, 1) that depends on the ray and the triangle alone.
float chance_of(Ray ray, uint prim) {
  uint h = prim;
  for (int i = 0; i < 3; ++i)
    h = hash_word(hash_word(h ^ floatBitsToUint(ray.origin[i])) ^ floatBitsToUint(ray.dir[i]));
  return float(h >> 8) * (1.0 / 16777216.0);
}

bool passes(Ray ray, Hit hit) {
  AT_TRIANGLE(hit.prim)
  WEIGHTS_OF_VERTICES(hit)
  float stopped = opacity(material_of(hit.prim), hit);
  return stopped < 1.0 && chance_of(ray, hit.prim) >= stopped;
}

void main() {
  uint index = gl_GlobalInvocationID.x;
  bool goes_on = false;
  uint id = index;
  Ray ray;
  if (index < indirect[push.args].count) {
    Hit hit = get_hit(hits, index);
    ray = get_ray(rays, index);
    if (push.first == 0u) {
      id = ids[index];
      put_part(wave_hits, id, hit);
    }
    goes_on = hit.prim != NO_HIT && passes(ray, hit);
    // The next float; t is not below 0.
    if (goes_on) ray.t_min = uintBitsToFloat(floatBitsToUint(abs(hit.t)) + 1u);
  }
  uvec4 who = subgroupBallot(goes_on);
  uint first = 0u;
  if (subgroupElect()) first = atomicAdd(queues.passed, subgroupBallotBitCount(who));
  first = subgroupBroadcastFirst(first);
  PUT_RECORDS(next_rays, first, goes_on, ray)
  if (goes_on) next_ids[first + subgroupBallotExclusiveBitCount(who)] = id;
}
