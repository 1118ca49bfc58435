// Crossings of a ray and triangles, for the kernels that find more than one. A kernel includes this file after
// lib/frame/kernel.glsl.
//
// Sources: those of lib/numeric/triangle_watertight.glsl, by whose arithmetic vertices are sheared and t is found, and
// of shaders/query/inside.comp, by whose rule ties are broken.
//
// Why a closed surface is crossed an even number of times by a line, and once at an edge or vertex where it is passed
// through: a vertex is sheared by the same operations in every triangle that holds it, so the triangles are those of
// one moved mesh, and the proof of inside.comp holds for its projection. A ray exactly through an edge or a vertex is
// moved by an infinitesimal step across its main axis, the same for all triangles. At a silhouette it then passes
// beside the surface or crosses both sides.
//
// t is that of the watertight test, with its bound: 15 * 2^-24 of the distance along the main axis. Boxes are culled as
// for that test.
//
// What is asked for alone is compiled. BALLOT_CULL leaves out triangles that are seen from their back or front.
// BALLOT_FILTERS leaves out what words of the ray say (filters.glsl). BALLOT_ALPHA leaves out those whose surface stops
// nothing where the ray meets it (opacity() of lib/shade/surface_material.glsl, as rendering does). BALLOT_EXACT tells
// what rounding may have decided; the bounds are in lib/query/sure.glsl. BALLOT_LAST: the ray is turned round
// (first.glsl), and seen from its other end.
//
// BALLOT_INSTANCES: all this holds in the space of each mesh (lib/tree/instances.glsl).
#include "crossing.glsl"
#if BALLOT_INSTANCES
// From the walk of a mesh to the scene: the number of a triangle, t, and the end of the ray's range.
#define SCENE_PRIM(prim) (first_prim + (prim))
#define SCENE_T(t) ((t) * object_scale)
#define SCENE_END(w) world.t_max
#else
#define SCENE_PRIM(prim) prim
#define SCENE_T(t) t
#define SCENE_END(w) w.ray.t_max
#endif
#if BALLOT_ALPHA
#include "../../shared/render.h"
#include "../shade/triangles.glsl"
#include "../shade/surface_material.glsl"
#endif
#if BALLOT_EXACT
#include "sure.glsl"
#endif

#if BALLOT_FILTERS
#include "filters.glsl"
#endif

// Must be called before crosses().
void begin_crossings(uint ray) {
#if BALLOT_FILTERS
  begin_filters(ray);
#endif
}

#if !BALLOT_LAST
#define GIVEN_WAY(ray) ray
#define GIVEN_T(t) t
#endif

// What rounding leaves open about a triangle; without BALLOT_EXACT nothing.
struct Doubt {
  bool open;        // whether the ray crosses it in range
  float low, high;  // units of the scaled ray: t is at least `low` if the ray crosses it, and at most `high` if that is
                    // not open
};

// Returns true if the ray crosses the triangle in range; then `hit` is the crossing, in units of the scaled ray. Exact:
// returns false too if that is open.
bool crosses(Walker w, uint texel, out Hit hit, out Doubt doubt) {
  TriangleTexels triangle = fetch_triangle(texel, texel_order(w.space));
  RaySpace s = w.space;
  vec3 p = uintBitsToFloat(triangle.a.xyz), q = uintBitsToFloat(triangle.b.xyz);
  precise vec3 z = uintBitsToFloat(triangle.c.xyz) - s.origin.z;
  vec3 x = multiply_add(vec3(s.first), z, multiply_add(p, vec3(s.scale), vec3(-s.origin.x)));
  vec3 y = multiply_add(vec3(s.second), z, multiply_add(q, vec3(s.scale), vec3(-s.origin.y)));
  vec2 a = vec2(x.x, y.x), b = vec2(x.y, y.y), c = vec2(x.z, y.z);
  float e0 = side_value(b, c), e1 = side_value(c, a), e2 = side_value(a, b);
  precise float det = e0 + e1 + e2;
  precise float inv = 1.0 / det;
  precise vec3 weights = vec3(e0, e1, e2) * inv;
  precise float t = multiply_add(weights.z, z.z, multiply_add(weights.y, z.y, weights.x * z.x)) * s.inv;
  hit = Hit(SCENE_T(t), SCENE_PRIM(triangle.a.w), weights.y, weights.z);
#if BALLOT_EXACT
  float room = sides_room(x, y, z, s.scale);
  float least = smaller(smaller(e0, e1), e2), most = larger(larger(e0, e1), e2);
  bool crossed = least > room || most < -room, open = !crossed && !(least < -room && most > room);
  float off = depth_room(z, det, room) * abs(s.inv);
  bool in_range = t - off > w.ray.t_min && t + off < w.ray.t_max;
  bool out_of_range = t + off < w.ray.t_min || t - off > w.ray.t_max;
  bool front = (e0 > 0.0) == (s.inv > 0.0);
  open = open || (crossed && !in_range && !out_of_range);
  doubt = Doubt(open, SCENE_T(open ? least_t(z, s.inv) : t - off), SCENE_T(t + off));
  crossed = crossed && in_range;
#else
  int s0 = side_sign(e0, b, c), s1 = side_sign(e1, c, a), s2 = side_sign(e2, a, b);
  bool crossed = s0 != 0 && s0 == s1 && s1 == s2 && t >= w.ray.t_min && t <= w.ray.t_max;
  bool front = (s0 > 0) == (s.inv > 0.0);
  doubt = Doubt(false, SCENE_T(t), SCENE_T(t));
#endif
#if BALLOT_INSTANCES
  front = front != is_mirrored;
#endif
#if BALLOT_LAST
  front = !front;
#endif
#include "crossing_filters.glsl"
  return crossed;
}

// The end of a span that is tested, by the number of ends that are left.
#if BALLOT_SHAPES
#define END_OF(left) ((left) & 1u)
#else
#define END_OF(left) 0u
#endif

#if BALLOT_SHAPES
// The same for an end of a shape's span: 0 where the ray enters, 1 where it leaves. The front of a closed shape is its
// outside, that of a disc where its normal points to.
bool crosses_shape(Walker w, uint texel, uint end, out Hit hit, out Doubt doubt) {
  uint prim = leaf_texel(texel).w;
  Shape shape = fetch_shape(prim);
  vec2 span;
  bool crossed = shape_span(shape, GIVEN_WAY(w.ray), span) && end < shape_ends();
  float t = GIVEN_T(span[end]);
  crossed = crossed && t >= w.ray.t_min && t <= w.ray.t_max;
  vec3 normal = shape_normal(shape, GIVEN_WAY(w.ray), span, end);
  vec2 uv = octahedral_of(normal);
  hit = Hit(SCENE_T(t), SCENE_PRIM(prim), uv.x, uv.y);
  doubt = Doubt(false, hit.t, hit.t);
  bool front = shape_ends() == 1u ? shape_dot(normal, GIVEN_WAY(w.ray).dir) < 0.0 : end == 0u;
#include "crossing_filters.glsl"
  return crossed;
}

// The same for a triangle or a shape. A triangle has one crossing, which stands for end 0.
bool crosses_end(Walker w, uint texel, uint end, out Hit hit, out Doubt doubt) {
  if (walks_shapes()) return crosses_shape(w, texel, end, hit, doubt);
  return crosses(w, texel, hit, doubt) && end == 0u;
}
#endif
