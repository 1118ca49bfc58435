#version 460
#extension GL_GOOGLE_include_directive : require
// Crossings: for each ray, how many triangles it crosses with t in [t_min, t_max], and which. A walk of the pair tree,
// one ray a lane, in no order; with BALLOT_FIRST nearer children first.
//
// Result: the number of crossings, a word a ray; UNFINISHED if the walk did not finish. With BALLOT_LISTS also
// the crossings, in no order (lib/query/listing.glsl). With BALLOT_FIRST the list has the first crossings
// (lib/query/first.glsl), and their number is that of the list: a row holds them in order, and behind them misses. Mode
// exact may list others besides, in no order.
//
// BALLOT_LAST: the last crossings take the place of the first.
//
// BALLOT_ANY: a ray ends at the first crossing that is found, whichever that is. For BALLOT_FIRST of one.
//
// lib/query/triangle_crossing.glsl has what a crossing is, and why closed surfaces are crossed an even number of times.
// The tree must hold each triangle in one leaf.
//
// With BALLOT_WIDE it walks the compressed eight-wide tree instead: 1.2 times as fast as four-wide nodes on lavapipe
// (tools/measured/queries.md), and these had been 1.1 times as fast as pairs.
//
// BALLOT_EXACT: a ray is UNSURE if rounding may have decided; the host finds its crossings exactly.
//
// BALLOT_INSTANCES: each ray walks by itself from one instance that it meets to the next (lib/query/instances.glsl).
#if BALLOT_WIDE
#define METHOD_WITHOUT_PAIRS
#endif
#include "../lib/frame/kernel.glsl"
#include "../shared/query.h"
#if BALLOT_LAST
// Returns the ray in the other direction, with the same points at t of the other sign.
Ray turned(Ray ray) { return Ray(ray.origin, -ray.t_max, -ray.dir, -ray.t_min); }
Ray load_turned(uint index) {
  Ray ray = load_ray(index);
  return is_dead(ray) ? ray : turned(ray);  // which may be dead by its end alone
}
#define GIVEN_RAY load_turned
// From the ray that is walked to the one that was given.
#define GIVEN_WAY(ray) turned(ray)
#define GIVEN_T(t) -(t)
#else
#define GIVEN_RAY load_ray
#endif
#if BALLOT_INSTANCES
#include "../lib/tree/instances.glsl"
#endif
#include "../lib/query/triangle_crossing.glsl"
#define RECORD uvec4
#include "../lib/query/listing.glsl"
#if BALLOT_FIRST
#include "../lib/query/first.glsl"
#endif
#if BALLOT_WIDE
#include "../lib/query/walk_bvh8.glsl"
#else
#include "../lib/query/walk_pairs.glsl"
#endif
#if BALLOT_INSTANCES
#include "../lib/query/instances.glsl"
#define IS_UNDER_WAY(w, live) (is_walking() || walk_next(w, live))
#else
#define IS_UNDER_WAY(w, live) is_walking()
#endif

layout(set = 0, binding = BIND_CROSSINGS, scalar) writeonly buffer Answers { uint answers[]; };

uvec4 record_of(Hit hit, float scale) {
  return uvec4(floatBitsToUint(hit.t * scale), hit.prim, floatBitsToUint(hit.u), floatBitsToUint(hit.v));
}

#if BALLOT_FIRST && !BALLOT_EXACT
// Writes the row of a ray. Returns the number of crossings in it.
uint list_first(float scale) {
  uint found = 0u;
  [[unroll]] for (uint i = 0u; i < FIRST; ++i) {
    bool is_free = first_hits[i].prim == NO_HIT;
    list(is_free ? uvec4(0x7F800000u, NO_HIT, 0u, 0u) : record_of(first_hits[i], scale));
    found += uint(!is_free);
  }
  return found;
}
#endif

void main() {
#if BALLOT_INSTANCES
  push = whole_push;
#endif
  uint index = push.ray_begin + gl_GlobalInvocationID.x;
  bool inside = index < push.ray_end;
  uint mine = inside ? index : push.ray_begin;
  bool wanted = begin_list(mine) && inside;
#if BALLOT_INSTANCES
  Walker w;
  bool live = begin_walks(wanted ? index : push.ray_end, w);
  float scale = GIVEN_T(world_scale);
  uint found = 0u;
#else
  Ray given = GIVEN_RAY(mine);
  bool live = wanted && !is_dead(given);
  if (!live) given = Ray(vec3(0.0), 0.0, vec3(0.0, 0.0, 1.0), 0.0);
  Walker w = make_walker(given);
  float scale = GIVEN_T(direction_scale(given.dir));
  uint found = 0u;
  begin_walk(live);
#endif
  begin_crossings(mine);
#if BALLOT_FIRST
  begin_first(SCENE_END(w));
#endif
#include "../lib/query/crossing_walk.glsl"
#if BALLOT_FIRST && BALLOT_EXACT
  unsure = open_t <= REACH;
#elif BALLOT_FIRST
  if (inside) found = list_first(scale);
#endif
  bool finished = finish_walks(1u);
  if (inside && WRITES_NUMBER) answers[index] = !finished ? UNFINISHED : unsure ? UNSURE : found;
}
