// Triangle test "double": the watertight test in float64. No ray slips between triangles that share an edge or a
// vertex, and the result for a triangle depends on ray and triangle alone. The nearest hit has the smallest t in
// double, and the smallest prim where t is equal.
//
// Source: Sven Woop, Carsten Benthin, Ingo Wald. Watertight Ray/Triangle Intersection. JCGT 2(1), 2013. Differs as
// lib/numeric/triangle_watertight.glsl does, whose proof holds here: edge functions have their exact sign, and zero
// counts as inside on both sides of an edge. Its bounds hold with w = 2^-53, as no step here rounds more: the point at
// t lies within 33 w M of the point of the triangle that has the hit's weights, where M is the largest |v - o|.
//
// There are two stages. The first, in float32, rejects triangles that the ray surely misses, and marks the others. The
// second runs over the marked triangles of a leaf after it (settle_leaf), as in lib/numeric/triangle_exact.glsl.
//
// What the first stage and the boxes see is off. Rays are off by w' |o| and by w' of each component of the direction,
// where w' = 2^-24, and vertices by w' / 2 of each coordinate, at most w' / 2 (M + |o|). So coordinates across the main
// axis are off by 13 w' M + 2 w' |o|: SIZE_WITH_ROOM and origin_room have room for more. lib/numeric/box_relative.glsl
// has room as well.
//
// Range: numbers are differences of doubles, and products of two lose nothing to underflow above 2^-400.
struct RaySpace {
  Ray given;                  // rounded
  dvec3 origin;               // o[m + 1], o[m + 2] and o[m], for the main axis m
  double first, second;       // d[m + 1] and d[m + 2] over -d[m]
  double along;               // d[m]
  double t_min, t_max;
  vec3 row_x, row_y;          // rows of the matrix that shears the rounded ray onto its main axis
  double best_t;              // of the nearest hit so far
  float reach;                // t of the walked ray, not less than that of the best hit, or t_max if there is none
  float start;                // t of the scaled ray where the walked ray starts (nearer_origin.glsl)
  float origin_room;          // added to distances from the walked ray's origin
  uint axis;                  // m
  uint first_texel, marked;   // of the leaf's first marked triangle; a bit for each marked one from there on
};
#define TRIANGLE_SETTLES

// True if the range of a ray is empty, which makes it dead (lib/tree/leaf.glsl).
#define IS_EMPTY_RANGE(begin, end) (given_in_double.t_max <= given_in_double.t_min)

#include "../tree/leaf_vertices.glsl"
#include "nearer_origin.glsl"

float largest_of(vec3 v) { return max(v.x, max(v.y, v.z)); }

// Vectors with the main axis last.
dvec3 turned_to(uint axis, dvec3 v) { return axis == 0u ? v.yzx : axis == 1u ? v.zxy : v; }

// Sets the range of the walked ray, and moves its origin nearer to the scene if it is far away.
void walk_double(inout Ray ray, Ray given, DoubleRay exact, inout RaySpace space) {
  space.start = walk_start(ray);
  space.reach = walked_t(given, exact.t_max, 0.0lf, space.start);
  float t_min = -walked_t(given, -exact.t_min, 0.0lf, -space.start);
  vec3 origin = ray.origin;
  if (space.start > 0.0) {
    double to_walk = packDouble2x32(uvec2(0u, (1150u - direction_exponent(given.dir)) << 20));
    precise dvec3 moved = exact.origin + exact.dir * to_walk * double(space.start);
    origin = vec3(float(moved.x), float(moved.y), float(moved.z));
    t_min = max(t_min, 0.0);
  }
  ray = Ray(origin, t_min, ray.dir, space.reach);
  space.origin_room = 0.25 * largest_of(abs(origin));
}

// Takes the ray in double from given_in_double.
RaySpace make_ray_space(inout Ray ray, Ray given) {
  DoubleRay exact = given_in_double;
  vec3 d = ray.dir, a = abs(d);
  bool x = a.x >= a.y && a.x >= a.z, y = !x && a.y >= a.z;
  float main_axis = x ? d.x : y ? d.y : d.z;
  float first = -(x ? d.y : y ? d.z : d.x) / main_axis, second = -(x ? d.z : y ? d.x : d.y) / main_axis;
  RaySpace space;
  space.row_x = x ? vec3(first, 1.0, 0.0) : y ? vec3(0.0, first, 1.0) : vec3(1.0, 0.0, first);
  space.row_y = x ? vec3(second, 0.0, 1.0) : y ? vec3(1.0, second, 0.0) : vec3(0.0, 1.0, second);
  space.given = given;
  space.axis = x ? 0u : y ? 1u : 2u;
  dvec3 dir = turned_to(space.axis, exact.dir);
  precise dvec2 slopes = -dir.xy / dir.z;
  space.origin = turned_to(space.axis, exact.origin);
  space.first = slopes.x;
  space.second = slopes.y;
  space.along = dir.z;
  space.t_min = exact.t_min;
  space.t_max = exact.t_max;
  space.best_t = exact.t_max;
  space.first_texel = 0u;
  space.marked = 0u;
  walk_double(ray, given, exact, space);
  return space;
}

uint texel_order(RaySpace space) { return AS_STORED; }
void change_ray() {}

#define SIZE_WITH_ROOM(m) 1.25 * (m)
#include "surely_missed.glsl"
#include "sheared_double.glsl"

#include "marked_leaf.glsl"

// Makes a triangle's hit the best one if it is in range and before that.
void settle_triangle(inout RaySpace space, uint texel, inout Hit best) {
  uint prim = leaf_texel(texel).w;
  Sheared s = shear(space, corners_in_double(texel));
  bool counts = meets(s) && s.t >= space.t_min && s.t <= space.best_t;
  if (counts && (best.prim == NO_HIT || s.t < space.best_t || prim < best.prim)) {
    best = Hit(narrow(s.t), prim, float(s.weights.y), float(s.weights.z));
    space.best_t = s.t;
    space.reach = walked_t(space.given, s.t, 0.0lf, space.start);
  }
}
