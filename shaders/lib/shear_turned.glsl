// The watertight shear after turning coordinates so that the ray's main axis is z, as in the paper: fewer operations than
// lib/shear_rows.glsl without fma(), and seven numbers a ray instead of nine. Packets whose rays have one main axis turn a
// triangle once for all of them: packet-wide 1.00 to 1.12 times as fast, 1.06 in the mean (lavapipe 25.0.7, four scenes, primary and
// shadow rays; `plain`, unchanged, 0.97 in the same run). Rays by themselves: while-while 1.05, dynamic-fetch 0.98.
#define TRIANGLE_TURNS

struct RaySpace {
  vec3 origin;  // turned
  uint axis;
  float inv, first, second, scale;
};

vec3 turned(vec3 v, uint axis) { return axis == 0u ? v.yzx : axis == 1u ? v.zxy : v; }
uvec4 turned(uvec4 v, uint axis) { return axis == 0u ? v.yzxw : axis == 1u ? v.zxyw : v; }

TriangleTexels turned(TriangleTexels t, uint axis) {
  return TriangleTexels(turned(t.a, axis), turned(t.b, axis), turned(t.c, axis), t.at);
}

RaySpace make_ray_space(Ray ray, Ray given) {
  Shear s = shear_of(ray);
  return RaySpace(turned(ray.origin, s.axis), s.axis, s.inv, s.first, s.second, s.scale);
}

uint main_axis(RaySpace space) { return space.axis; }

// At most one product and the sum are rounded.
vec3 sheared(RaySpace space, vec3 p) {
  precise float x = space.scale * p.x + space.first * p.z;
  precise float y = space.scale * p.y + space.second * p.z;
  precise float z = space.inv * p.z;
  return vec3(x, y, z);
}

bool hit_turned(Ray ray, inout RaySpace space, TriangleTexels triangle, out float t, out float u, out float v) {
  Corners corners = corners_of(triangle);
  precise vec3 a = corners.v0 - space.origin, b = corners.v1 - space.origin, c = corners.v2 - space.origin;
  return hit_sheared(Sheared(sheared(space, a), sheared(space, b), sheared(space, c)), t, u, v);
}

bool hit_triangle(Ray ray, inout RaySpace space, TriangleTexels triangle, out float t, out float u, out float v) {
  return hit_turned(ray, space, turned(triangle, space.axis), t, u, v);
}
