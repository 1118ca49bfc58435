// The surface point at a hit, and the secondary rays that leave it. The origin offset policy says where these rays
// start; each policy is a file lib/origin/<name>.glsl that defines
//
//   vec3 origin_on(Surface s, float side)                     an origin off the triangle, on the side that the ray came
//                                                             from (side 1) or behind the surface (side -1)
//   Ray leave(Surface s, float side, vec3 dir, float t_max)   the ray from such an origin along the unit vector dir
//
// Only the arithmetic of lib/numeric/reproducible.glsl is used, so equal hits give equal rays on every device.
#include "../numeric/reproducible.glsl"

#ifndef BALLOT_ORIGIN
#error a variant must give BALLOT_ORIGIN: a number of shaders/shared/render.h
#endif

#include "../shade/triangles.glsl"

// A surface point at a hit.
struct Surface {
  vec3 position;
  vec3 normal;        // geometric, unit, on the side that the ray came from
  vec3 dir;           // direction of the ray, unit
  vec3 v0, v1, v2;    // vertices of the triangle
  vec3 sum;           // |b0 v0| + |b1 v1| + |b2 v2|, with the barycentric weights b of position
  bool front;         // true if the ray sees the vertices counter-clockwise
#if BALLOT_HAS_INSTANCES
  vec3 shift;         // translation of the instance
  float spread;       // its spread (lib/shade/triangles.glsl)
#endif
#if BALLOT_HAS_SHAPES
  bool shape;         // it is on a shape, whose bounds v0, v1, v2 have; sum is |origin of the ray| + |way along it|
#endif
};

// Returns the axis of the smallest component of v.
vec3 least_axis(vec3 v) {
  vec3 a = abs(v);
  return a.x <= a.y && a.x <= a.z ? vec3(1.0, 0.0, 0.0) : a.y <= a.z ? vec3(0.0, 1.0, 0.0) : vec3(0.0, 0.0, 1.0);
}

// Returns the unit normal of the triangle v0 v1 v2. The cross product of a sliver's rounded edges may lean along the
// sliver, so that part is subtracted: the normal is perpendicular to the triangle's length up to a few roundings,
// however thin it is.
vec3 geometric_normal(vec3 v0, vec3 v1, vec3 v2) {
  precise vec3 a = v1 - v0, b = v2 - v0;
  float scale = unit_scale(max(largest(a), largest(b)));  // the products of small edges would underflow
  precise vec3 scaled_a = a * scale, scaled_b = b * scale;
  vec3 along = exact_unit(largest(a) > largest(b) ? a : b);
  vec3 normal = exact_unit(exact_cross(scaled_a, scaled_b));
  precise vec3 upright = normal - along * exact_dot(normal, along);
  if (largest(upright) < 0.01) upright = exact_cross(along, least_axis(along));  // no area is left
  return exact_unit(upright);
}

// Returns the point of a hit, seen from the side where its vertices are counter-clockwise, and without a direction.
Surface surface_at(Hit hit) {
  Surface s;
  AT_TRIANGLE(hit.prim)
  s.v0 = vertex(hit.prim, 0u), s.v1 = vertex(hit.prim, 1u), s.v2 = vertex(hit.prim, 2u);
  precise float b0 = 1.0 - hit.u - hit.v;
  precise vec3 p0 = b0 * s.v0, p1 = hit.u * s.v1, p2 = hit.v * s.v2;
  precise vec3 sum = abs(p0) + abs(p1) + abs(p2), position = p0 + p1 + p2;
  s.sum = sum;
  s.position = position;
  s.normal = geometric_normal(s.v0, s.v1, s.v2);
  s.dir = vec3(0.0);
  s.front = true;
#if BALLOT_HAS_INSTANCES
  s.shift = vec3(placed.x.w, placed.y.w, placed.z.w);
  s.spread = placed.spread;
#endif
#if BALLOT_HAS_SHAPES
  s.shape = placed.shapes;
#endif
  return s;
}

Surface surface_of(Ray ray, Hit hit) {
  Surface s = surface_at(hit);
  s.dir = exact_unit(ray.dir);
#if BALLOT_HAS_SHAPES
  if (s.shape) {
    precise vec3 way = ray.dir * hit.t, sum = abs(ray.origin) + abs(way), position = ray.origin + way;
    s.sum = sum;
    s.position = position;
    s.normal = exact_unit(normal_of_shape(hit));
  }
#endif
  s.front = !(exact_dot(s.normal, s.dir) > 0.0);
  if (!s.front) s.normal = -s.normal;
  return s;
}

#if BALLOT_ORIGIN == ORIGIN_CONSTANT
#include "constant.glsl"
#elif BALLOT_ORIGIN == ORIGIN_ULP
#include "ulp.glsl"
#elif BALLOT_ORIGIN == ORIGIN_PBRT
#include "pbrt.glsl"
#elif BALLOT_ORIGIN == ORIGIN_PROVED
#include "proved.glsl"
#else
#include "bounded.glsl"
#endif

// Returns a unit direction on the normal's side with a density proportional to the cosine, by Malley's method: a
// uniform point of the disk is lifted onto the hemisphere.
vec3 cosine_direction(Surface s, float r1, float r2) {
  vec3 n = s.normal;
  vec3 x = exact_unit(exact_cross(n, least_axis(n))), y = exact_cross(n, x);
  precise vec2 disk = exact_turn(r2) * exact_sqrt(r1);
  precise vec3 dir = x * disk.x + y * disk.y + n * exact_sqrt(1.0 - r1);
  return exact_unit(dir);
}

