// The watertight shear as a product with rows of the shear, a power of two and zeros: no selects, for devices with fma().

struct RaySpace {
  vec3 row_x, row_y, row_z;  // of the matrix that shears the ray onto its main axis
};

RaySpace make_ray_space(Ray ray, Ray given) {
  Shear s = shear_of(ray);
  if (s.axis == 0u) return RaySpace(vec3(s.first, s.scale, 0.0), vec3(s.second, 0.0, s.scale), vec3(s.inv, 0.0, 0.0));
  if (s.axis == 1u) return RaySpace(vec3(0.0, s.first, s.scale), vec3(s.scale, s.second, 0.0), vec3(0.0, s.inv, 0.0));
  return RaySpace(vec3(s.scale, 0.0, s.first), vec3(0.0, s.scale, s.second), vec3(0.0, 0.0, s.inv));
}

// A row holds at most two numbers besides zero, so at most one product and the sum are rounded, or the sum alone.
vec3 sheared(RaySpace space, vec3 p) {
  precise float x = fma(space.row_x.x, p.x, fma(space.row_x.y, p.y, space.row_x.z * p.z));
  precise float y = fma(space.row_y.x, p.x, fma(space.row_y.y, p.y, space.row_y.z * p.z));
  precise float z = fma(space.row_z.x, p.x, fma(space.row_z.y, p.y, space.row_z.z * p.z));
  return vec3(x, y, z);
}

bool hit_triangle(Ray ray, inout RaySpace space, TriangleTexels triangle, out float t, out float u, out float v) {
  Corners corners = corners_of(triangle);
  precise vec3 a = corners.v0 - ray.origin, b = corners.v1 - ray.origin, c = corners.v2 - ray.origin;
  return hit_sheared(Sheared(sheared(space, a), sheared(space, b), sheared(space, c)), t, u, v);
}
