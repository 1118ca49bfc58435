// Rays and triangles in double, for the triangle test "double".
//
//   given_in_double          the ray that load_ray() has loaded last, or that an instance has made of it
//   corners_in_double(texel) the corners of a triangle; `texel` is its first in the array of leaves
//
// BALLOT_RAYS_DOUBLE: the rays are given as doubles; else those of float32 are widened. BALLOT_DOUBLES: the scene has
// vertices in double, of which leaves hold the roundings (engine/tree/device/double_corners.h).
#include "float_bits.glsl"

struct DoubleRay {
  dvec3 origin;
  double t_min;
  dvec3 dir;
  double t_max;
};
DoubleRay given_in_double;

DoubleRay widen(Ray ray) {
  return DoubleRay(widen(ray.origin), widen(ray.t_min), widen(ray.dir), widen(ray.t_max));
}
// Keeps NaN and infinity.
Ray rounded(DoubleRay ray) { return Ray(vec3(ray.origin), float(ray.t_min), vec3(ray.dir), float(ray.t_max)); }

dvec2 doubles_of(uvec4 texel) { return dvec2(packDouble2x32(texel.xy), packDouble2x32(texel.zw)); }
DoubleRay double_ray_of(uvec4 a, uvec4 b, uvec4 c, uvec4 d) {
  dvec2 oxy = doubles_of(a), oz_min = doubles_of(b), dxy = doubles_of(c), dz_max = doubles_of(d);
  return DoubleRay(dvec3(oxy, oz_min.x), oz_min.y, dvec3(dxy, dz_max.x), dz_max.y);
}
