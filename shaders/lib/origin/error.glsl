// A bound of the rounding error of a surface point: how far it may lie off the plane of its triangle.

const float W = 5.9604645e-8;  // 2^-24, the largest relative error of one rounding

#if BALLOT_HAS_INSTANCES
// Returns a bound of the distance along any unit vector between the vertices of an instance's triangle, as vertex()
// computes them, and those that the matrix gives. M is the matrix, T the translation, C the spread, p the point and E
// the triangle's largest extent along an axis. Along axis k the products and sums of M v + T are off by
//   w (4.1 sum_i |M_ki| |v_i| + 1.1 |T_k|) <= w (4.1 C (|p - T| + E) + 1.1 |T|)
// in max norms, because v = M^-1 (the moved vertex - T) and C bounds the row sums of |M| |M^-1|. Along a unit
// vector the errors of three axes count sqrt(3) times at most: w (7.2 C (|p - T| + E) + 2 |T|).
float instance_error(Surface s, float extent) {
  precise vec3 from = s.position - s.shift;
  precise float error = W * (7.2 * s.spread * (largest(from) + extent) + 2.0 * largest(s.shift));
  return error;
}
#endif

#if BALLOT_HAS_SHAPES
// Returns a bound of the distance between the point of a shape's hit and the surface, and beyond it of what the next
// test may move the surface by. E is the shape's extent along an axis, M that and the way to the hit. By
// lib/shape/shapes.glsl the test moves a shape by 8 w M along each axis, which is 14 w M along any vector, and its size
// by 4 w E, and t moves the point by 26 w M. The next test, from nearby, moves the shape by 14 w E and its size by
// 4 w E. The point o + t d is rounded by 4 w (|o| + |t d|). The spread of an instance stretches all.
float shape_error(Surface s) {
  vec3 extent = max(max(s.v0, s.v1), s.v2) - min(min(s.v0, s.v1), s.v2);
  precise float error = 72.0 * s.spread * W * (largest(extent) + largest(s.sum));
  return error;
}
#endif

// Returns a bound of the distance along the normal between the computed point and the plane of its triangle.
//
// After: Matt Pharr, Wenzel Jakob, Greg Humphreys. Physically Based Rendering, section 6.8. gamma_n = n w / (1 - n w)
// bounds n roundings of w = 2^-24; the product of the per-axis bounds with the normal is a bound along the normal. Per
// axis, for p = b0 v0 + b1 v1 + b2 v2 and S = |b0 v0| + |b1 v1| + |b2 v2|:
//   products and two sums                                 gamma_3 S
//   b0 = 1 - b1 - b2, two roundings of at most w each     2 w |v0|
//   p + offset n, the product and the sum                 2 w S
// These 5 w S count twice, because the normal is rounded too: w (10 S + 2 |v0|). The weights themselves may be wrong:
// they add up to 1 whatever they are, so p still lies in the plane. The bound holds for triangles whose height is well
// above w times their extent and their coordinates; the normal of a thinner triangle is itself rounding error.
float position_error(Surface s) {
#if BALLOT_HAS_SHAPES
  if (s.shape) return shape_error(s);
#endif
  precise vec3 error = W * (10.0 * s.sum + 2.0 * abs(s.v0));
#if BALLOT_HAS_INSTANCES
  vec3 extent = max(max(s.v0, s.v1), s.v2) - min(min(s.v0, s.v1), s.v2);
  precise float at = exact_dot(abs(s.normal), error) + instance_error(s, largest(extent));
  return at;
#else
  return exact_dot(abs(s.normal), error);
#endif
}
