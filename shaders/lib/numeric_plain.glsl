// Numeric mode "plain": Moeller-Trumbore from the vertices, boxes without padding.
//
// Source: Tomas Moeller, Ben Trumbore. Fast, Minimum Storage Ray/Triangle Intersection. Journal of Graphics Tools, 1997.
// Not watertight: a ray that passes a shared edge closer than float32 resolves can miss both triangles.

struct RaySpace {
  uint unused;
};

RaySpace make_ray_space(Ray ray) { return RaySpace(0u); }

bool hit_triangle(Ray ray, RaySpace space, vec3 v0, vec3 v1, vec3 v2, out float t, out float t_error, out float u,
                  out float v) {
  vec3 e1 = v1 - v0, e2 = v2 - v0, s = ray.origin - v0;
  vec3 p = cross(ray.dir, e2), q = cross(s, e1);
  float det = dot(e1, p), inv = 1.0 / det;
  t = dot(e2, q) * inv;
  t_error = 0.0;
  u = dot(s, p) * inv;
  v = dot(ray.dir, q) * inv;
  return det != 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0;
}

// Every hit counts, wherever its leaf's box is.
bool settle_t(inout float t, float t_error, vec2 interval) { return true; }

vec3 box_padding(Ray ray) { return vec3(0.0); }
