// Triangle test "moeller": from the vertices, without precomputed values.
//
// Source: Tomas Moeller, Ben Trumbore. Fast, Minimum Storage Ray/Triangle Intersection. Journal of Graphics Tools,
// 1997.
// Not watertight: a ray that passes a shared edge closer than float32 resolves can miss both triangles.

struct RaySpace {
  uint unused;
};

RaySpace make_ray_space(inout Ray ray, Ray given) { return RaySpace(0u); }
uint texel_order(RaySpace space) { return AS_STORED; }

#include "../tree/leaf_vertices.glsl"
#include "hit_order.glsl"

bool hit_triangle(Ray ray, inout RaySpace space, TriangleTexels triangle, out float t, out float u, out float v) {
  Corners c = corners_of(triangle);
  vec3 e1 = c.v1 - c.v0, e2 = c.v2 - c.v0, s = ray.origin - c.v0;
  vec3 p = cross(ray.dir, e2), q = cross(s, e1);
  float det = dot(e1, p), inv = 1.0 / det;
  t = dot(e2, q) * inv;
  u = dot(s, p) * inv;
  v = dot(ray.dir, q) * inv;
  return det != 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0;
}
