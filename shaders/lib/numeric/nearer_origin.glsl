// A nearer origin for rays that start far from the scene. Error bounds of boxes and of float32 triangle tests grow with
// the distance to the ray's origin: from 10^6 radii away boxes are padded by more than the scene, and every ray meets
// every box. Mode "exact" decides about the ray as given, so it may walk another one: o' = o + s d, rounded to float32,
// with t' = t - s.
//
// The bounds, with w = 2^-24. s is a float32, so the product s d is exact in double, and the sum rounds by 2^-53 of
// itself. It is then rounded to float32, so o' is off by little more than w |o'|. Boxes have room for that where they
// are measured from zero (lib/numeric/box_relative.glsl); elsewhere rays keep their origin. The float32 test of
// triangles adds `origin_room`. The range of t' is widened to float32.

const float FAR = 8.0;  // radii; nearer rays keep their origin

// Returns the t from which a scaled ray is walked, or 0 for a ray that keeps its origin.
//
// All points of the scene lie within r of its middle; 2.4e-7 of the largest coordinate covers the rounding of both. A
// scaled direction is not shorter than 1, so t' of these points is at least r, less the rounding of s. That is 14 w s
// at most for a ray that hits, whose direction is within an eighth of the middle's: w s for the subtraction of the
// origin, 3 w s for each of the products, 5 w s for the division (2.5 ulp) and 2 w s for the last two steps. 16 w s are
// granted.
float walk_start(Ray ray) {
#if BALLOT_BOX_ORIGIN
  return 0.0;
#else
  vec3 lo = push.scene_lo, hi = push.scene_hi, size = 0.5 * hi - 0.5 * lo, most = max(abs(lo), abs(hi));
  vec3 to = 0.5 * lo + 0.5 * hi - ray.origin, apart = abs(to);
  float r = 1.01 * (size.x + size.y + size.z) + 2.4e-7 * max(most.x, max(most.y, most.z));
  float distance = max(apart.x, max(apart.y, apart.z));
  // Beyond these limits components of the direction below 2^-126 would count, or numbers leave the range of float32.
  if (!(distance > FAR * r && distance < 1e18 * r && distance < 1e37)) return 0.0;
  float middle = dot(to, ray.dir) / dot(ray.dir, ray.dir);
  return max(middle - 2.0 * r - 1e-6 * middle, 0.0);
#endif
}

vec3 moved_origin(Ray ray, float start) {
  precise dvec3 moved = widen(ray.origin) + dvec3(ray.dir) * double(start);
  return vec3(float(moved.x), float(moved.y), float(moved.z));
}

// Returns a number, never denormal, that is not less than t + error in units of the scaled ray minus `start`, but cut
// off near 3.4e38. `error` has room for the rounding of the sum.
float walked_t(Ray given, double t, double error, float start) {
  uint e = direction_exponent(given.dir);
  precise double from_start = (t + error) * packDouble2x32(uvec2(0u, (e + 896u) << 20)) - double(start);
  float rounded = float(clamp(from_start, -3.4e38lf, 3.4e38lf));
  if (abs(rounded) < 1e-37) return 1e-37;
  return uintBitsToFloat(rounded > 0.0 ? floatBitsToUint(rounded) + 1u : floatBitsToUint(rounded) - 1u);
}

// Moves the origin of a scaled ray nearer to the scene, if it is far away. Returns the t of the new origin, or 0.
float move_nearer(inout Ray ray, Ray given) {
  float start = walk_start(ray);
  if (start > 0.0) {
    float t_min = -walked_t(given, -widen(given.t_min), 0.0lf, -start);
    ray = Ray(moved_origin(ray, start), max(t_min, 0.0), ray.dir, walked_t(given, widen(given.t_max), 0.0lf, start));
  }
  return start;
}
