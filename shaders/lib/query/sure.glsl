// Bounds of the rounding errors of crossings.comp, for mode exact: what is decided by more than these is decided as
// exact arithmetic decides it.
//
// w = 2^-24, and M is at least |v - origin| on every axis, in units of the sheared triangle. The watertight test
// (lib/numeric/triangle_watertight.glsl) moves each vertex by at most 11 w M across the ray's main axis, and finds a
// side of the moved triangle with its exact sign and a relative error of 2 w. With m the largest sheared coordinate, a
// side of the true triangle differs from it by at most 4 * 11 w M m + 2 (11 w M)^2. sides_room() takes 16 w instead of
// 11 w. M is at most m plus the largest depth, because the shear's factors are at most 1. 2^-90 covers what underflows.
//
// With B this bound and det the sum of the sides, which have one sign, the true weights differ by at most 3 B / (det -
// 3 B) in all from those of the moved triangle, and so does t, times the range of the depths. To this come 8 w of the
// largest depth (depths and the division) and 15 w (weights and their sum); depth_room() takes 32 w. 1e-37 covers
// numbers that are flushed. A crossing that is open still lies between the depths of the vertices.

// Returns the bound of the error of a side.
float sides_room(vec3 x, vec3 y, vec3 z, float scale) {
  vec3 a = larger(abs(x), abs(y)), depth = abs(z);
  float m = larger(larger(a.x, a.y), a.z), far = larger(larger(depth.x, depth.y), depth.z);
  float moved = 9.5367432e-7 * (m + far * scale);
  return moved * (4.0 * m + 2.0 * moved) + 8.0779357e-28;
}

// Returns the bound of the error of a depth and of the t that it stands for, times the main component of the direction.
float far_room(vec3 z) {
  float far = larger(larger(abs(z.x), abs(z.y)), abs(z.z));
  return 1.9073487e-6 * far + 1.0e-37;
}

// Returns a number that t of a point of the triangle is not below. `inv` is the reciprocal of the direction's main
// component.
float least_t(vec3 z, float inv) {
  float first = smaller(smaller(z.x * inv, z.y * inv), z.z * inv);
  return first - far_room(z) * abs(inv);
}

// Returns the bound of the error of t times the main component of the direction, or infinity.
float depth_room(vec3 z, float det, float room) {
  float span = larger(larger(z.x, z.y), z.z) - smaller(smaller(z.x, z.y), z.z);
  float left = abs(det) - 3.0 * room;
  float spread = left > 0.0 ? 3.0 * room / left : uintBitsToFloat(0x7F800000u);
  return far_room(z) + spread * span;
}
