// The first stage of tests that decide in more than float32: rejects most triangles that a ray misses. It is included
// behind RaySpace, whose row_x, row_y and origin_room it reads.
//
// The triangle is sheared as in lib/numeric/triangle_watertight.glsl. The bound, with w = 2^-24 and M the largest
// |v - o|. Coordinates across the main axis are off by at most 11 w M (derived there; a division here saves 1 w M,
// which is room for the flush of numbers below 2^-126 if M is at least 1e-12). Let L be the largest of these
// coordinates as computed. An edge function then moves by at most 44 w M L + 242 w^2 M^2, and its own two products and
// difference round by 6 w L^2 <= 12 w M L at most. The bound, 64 w M (L + 4 w M), has room for terms of second order
// and its own rounding. M up to 1e18 keeps products finite. Where the origin is off by w |o|, coordinates across are
// off by 2 w |o| more, and M + |o| / 4 in place of M has room. SIZE_WITH_ROOM(m) is M, or more where more is off.

// Returns true if two edge functions surely have opposite signs.
bool surely_missed(Ray ray, RaySpace space, Corners corners) {
  vec3 a = corners.v0 - ray.origin, b = corners.v1 - ray.origin, c = corners.v2 - ray.origin;
  vec3 x = vec3(dot(space.row_x, a), dot(space.row_x, b), dot(space.row_x, c));
  vec3 y = vec3(dot(space.row_y, a), dot(space.row_y, b), dot(space.row_y, c));
  vec3 e = x.zxy * y.yzx - y.zxy * x.yzx;
  float m = SIZE_WITH_ROOM(largest_of(max(abs(a), max(abs(b), abs(c))))) + space.origin_room;
  float l = largest_of(max(abs(x), abs(y)));
  float bound = 3.8146973e-6 * m * (l + 2.3841858e-7 * m);
  return max(e.x, max(e.y, e.z)) > bound && min(e.x, min(e.y, e.z)) < -bound && m >= 1e-12 && m <= 1e18;
}
