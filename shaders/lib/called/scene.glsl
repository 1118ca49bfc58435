// What a kernel whose text is a user's asks of a scene. engine/answer/user_kernel.h says how such a kernel is made; its
// text begins behind this file.
//
//   Hit nearest(Ray ray)                       the nearest hit; prim is NO_HIT and t infinite on a miss
//   bool any(Ray ray)                          whether there is a hit
//   uint count(Ray ray)                        the triangles that the ray crosses
//   Nearest closest(vec3 point)                the closest point of the triangles
//   Nearest closest(vec3 point, float farthest)  the same, no farther away than that
//   vec3 corner(uint prim, uint which)         corner 0, 1 or 2 of a triangle, where its instance has it
//   uvec2 place(uint prim)                     the number of the instance, and of the triangle in its mesh
//   bool accept(Hit hit)                       the user's, if he writes it: a hit that it refuses is left out by
//                                              nearest(), any(), count() and closest()
//   bool intersect(uint prim, Ray ray, inout Hit hit)
//                                              the user's, if he writes it: finds what a ray meets of his shape `prim`,
//                                              sets t, u and v of the hit, and returns true if there is any
//   bool is_shape(uint prim)                   the user's, if some prims are triangles after all: false for those
// Records and their dead values are those of shared/layout.h and shared/query.h. The answers are, to the last bit,
// those of shaders/traverse/while_while.comp, shaders/query/crossings.comp and shaders/query/closest_point.comp: the
// text of the walks is the same.
//
//   Flow   each call is a walk of its lane alone, without subgroup operations: it may stand in any control flow
//   Memory the stacks of the walks that are called, STACK_SIZE words each (closest: twice as many), and TOP_STACK_SIZE
//          words among instances
//
// What is called alone is compiled: CALLS_NEAREST, CALLS_ANY, CALLS_COUNT, CALLS_CLOSEST, CALLS_CORNER, CALLS_PLACE are
// 1 if it is, else 0.
// CALLED_ACCEPT, CALLED_INTERSECT and CALLED_IS_SHAPE are defined if there is such a function of the user's.
// CALLED_INCLUDED is defined if the calls stand in a program's own shader (engine/answer/user_include.h).
//
// accept() sees every triangle that count() would count; of nearest() and closest() every one that is nearer than what
// was accepted before it; of any() every one until it accepts one. Of closest() t is the distance. The order is the
// walk's. So an answer does not depend on the order if accept() goes by nothing but the hit and what was set before the
// call. It must not call the scene.
//
// intersect() gets the ray in the space of the mesh, its direction scaled by a power of two, and with the t_max that a
// hit has to be within; t counts multiples of that direction. What it finds must lie in the box that the user gave for
// the shape, but for rounding of its own, which he adds to the box: a ray that misses the box is not shown to it.
// count() counts a shape once.
#define METHOD_CALLED
#if CALLS_ANY
#undef BALLOT_ANY_HIT
#define BALLOT_ANY_HIT 2  // ANY_HIT_ASKED
#endif
#include "../frame/kernel.glsl"
#include "../../shared/query.h"

#if CALLS_NEAREST || CALLS_ANY
#include "../tree/walk.glsl"
#include "../tree/while_while.glsl"
#include "../frame/trace_ray.glsl"

void trace_asked(Ray ray) {
#if BALLOT_INSTANCES
  push = whole_push;
#endif
  asked_ray = ray;
  trace_ray(0u);
}
#elif BALLOT_INSTANCES && CALLS_COUNT
#include "../tree/instances.glsl"
#elif BALLOT_INSTANCES
#include "../tree/meshes.glsl"
#endif

#if CALLS_NEAREST
Hit nearest(Ray ray) {
#if CALLS_ANY
  takes_any = false;
#endif
  trace_asked(ray);
  uvec4 h = hit_words[0];
  return Hit(uintBitsToFloat(h.x), h.y, uintBitsToFloat(h.z), uintBitsToFloat(h.w));
}
#endif

#if CALLS_ANY
bool any(Ray ray) {
  takes_any = true;
  trace_asked(ray);
  return hit_words[0].y != NO_HIT;
}
#endif

#if CALLS_COUNT
#include "../query/triangle_crossing.glsl"
#include "../query/walk_pairs.glsl"
#if BALLOT_INSTANCES
#include "../query/instances.glsl"
#define IS_UNDER_WAY(w, live) (is_walking() || walk_next(w, live))
#else
#define IS_UNDER_WAY(w, live) is_walking()
#endif

#ifdef CALLED_INTERSECT
// crosses() for triangles and shapes.
bool crosses_any(Walker w, uint texel, uint end, out Hit hit, out Doubt doubt) {
#if BALLOT_SHAPES
  if (walks_shapes()) return crosses_shape(w, texel, end, hit, doubt);
#endif
  uint prim = fetch_triangle(texel, AS_STORED).a.w;
#ifdef CALLED_IS_SHAPE
  if (!is_shape(scene_prim(prim))) return crosses(w, texel, hit, doubt) && end == 0u;
#endif
  float t, u, v;
  bool met = meets_shape(w.ray, prim, t, u, v) && t >= w.ray.t_min && t <= w.ray.t_max;
  hit = Hit(SCENE_T(t), SCENE_PRIM(prim), u, v);
  doubt = Doubt(false, hit.t, hit.t);
  return met && end == 0u;
}
#endif

uint count(Ray ray) {
  asked_ray = ray;
  uint found = 0u;
#if BALLOT_INSTANCES
  push = whole_push;
  Walker w;
  bool live = begin_walks(0u, w);
  float scale = world_scale;
#else
  bool live = !is_dead(ray);
  if (!live) ray = Ray(vec3(0.0), 0.0, vec3(0.0, 0.0, 1.0), 0.0);
  Walker w = make_walker(ray);
  float scale = direction_scale(ray.dir);
  begin_walk(live);
#endif
#include "../query/crossing_walk.glsl"
  return found;
}
#endif

#if CALLS_CLOSEST
#include "../query/closest_point.glsl"

#ifdef CALLED_ACCEPT
bool is_accepted(Probe p, uint texel, uint prim) {
#if BALLOT_SHAPES
  if (walks_shapes()) {
    ShapeNear s = shape_near(texel);
    vec2 uv = octahedral_of(s.normal);
    return accept(Hit(s.distance, prim, uv.x, uv.y));
  }
#endif
  Around t = around(p, texel);
  Near n = nearest_of(t);
  Foot f = foot_of(t, n);
  precise float root = sqrt(n.distance2);
  return accept(Hit(root * (1.0 / p.scale), prim, f.weights.y, f.weights.z));
}
#endif

Nearest closest(vec3 point, float farthest) {
#if BALLOT_INSTANCES
  begin_scene();
#endif
  const bool inside = true;
  vec4 record = vec4(point, farthest);
#include "../query/closest_walk.glsl"
  store_nearest(0u, p, best, limit);
  vec4 at = uintBitsToFloat(hit_words[0]);
  uvec4 h = hit_words[1];
  return Nearest(at.xyz, at.w, h.x, uintBitsToFloat(h.y), uintBitsToFloat(h.z), h.w);
}

Nearest closest(vec3 point) { return closest(point, uintBitsToFloat(0x7F800000u)); }
#endif

#if CALLS_CORNER
#include "../../shared/render.h"
#include "../shade/triangles.glsl"

vec3 corner(uint prim, uint which) {
  AT_TRIANGLE(prim)
  return vertex(prim, which);
}
#endif

#if CALLS_PLACE
layout(set = 0, binding = BIND_USER_PLACES, scalar) readonly buffer UserPlaces { uvec2 user_places[]; };

uvec2 place(uint prim) {
  uint lo = 0u, hi = uint(user_places.length()) - 1u;  // the last instance that begins with it or before
  while (lo < hi) {
    uint mid = (lo + hi + 1u) / 2u;
    if (user_places[mid].x <= prim)
      lo = mid;
    else
      hi = mid - 1u;
  }
  return uvec2(user_places[lo].y, prim - user_places[lo].x);
}
#endif

#if defined(CALLED_ACCEPT) || defined(CALLED_INTERSECT)
uint scene_prim(uint prim) {
#if BALLOT_INSTANCES
  return first_prim + prim;
#else
  return prim;
#endif
}
#endif

#if defined(CALLED_ACCEPT) && (CALLS_NEAREST || CALLS_ANY)
bool is_accepted(Hit hit) {
  uint prim = scene_prim(prim_at(hit.prim));
#if BALLOT_INSTANCES
  return accept(Hit(hit.t * object_scale * world_scale, prim, hit.u, hit.v));
#else
  return accept(Hit(hit.t * direction_scale(asked_ray.dir), prim, hit.u, hit.v));
#endif
}
#endif

#ifdef CALLED_INTERSECT
bool meets_shape(Ray ray, uint prim, out float t, out float u, out float v) {
  Hit hit = Hit(ray.t_max, scene_prim(prim), 0.0, 0.0);
  bool met = intersect(hit.prim, ray, hit);
  t = hit.t;
  u = hit.u;
  v = hit.v;
  return met;
}
#endif

#ifdef CALLED_INCLUDED
// True if the driver has cut a loop of this invocation short: no answer of it is to be used.
bool ballot_is_cut() { return !finish_walks(1u); }
#else
// Which invocation of the user's main() this is. Returns false if there is none.
bool ballot_begin(out uint index) {
#if BALLOT_INSTANCES
  push = whole_push;
#endif
  index = push.ray_begin + gl_GlobalInvocationID.x;
  return index < push.ray_end;
}

void ballot_end() { finish_walks(1u); }
#endif
