// The offset along the normal that keeps a ray from finding the triangle that it leaves.
//
// Theorem. The watertight test (lib/numeric/triangle_watertight.glsl), and exact arithmetic, report a miss for this ray
// and its start triangle. This holds for every triangle, slivers too, and for every direction with m . d >= -32 w,
// where w = 2^-24 and m is the normal on the side of the origin. All generators keep to that condition, except for
// shadow rays to a light behind the surface, which is in its own shadow. The theorem assumes that t neither overflows
// nor underflows: extents in [2^-80, 2^80] scene units.
//
// Proof. Let a = v - o be the exact position of a vertex seen from the origin o, M at least |a| on every axis, Z the
// direction's largest component, and z its axis. The test decides exactly, but on vertices x~, y~ that lie off the
// sheared ones, x = ax - az dx / Z and y likewise, by at most 11 w M, as is shown there. If the test accepts, the exact
// edge functions of the moved vertices have one sign. Divided by their sum they are weights b >= 0 that add up to 1,
// and sum(b x~) = sum(b y~) = 0. Then the point q = sum(b a) of the triangle itself, not of the moved one, is s d + r
// with s = qz / Z and with
//   |rx|, |ry| <= 11 w M on the two other axes, rz = 0.
// t has the sign of sum(e az) / Z: the reciprocal of the e's sum is one number for all vertices, the reciprocal of Z
// comes last, and both have the right signs. Each of the terms is off by a factor within 1 +- 8 w: az by
// w (subtraction), e by 2 w, and 4 w of two products and two sums. So a hit at t >= 0 has s >= -8 w M / |Z|. Also
// |s| <= M / |Z|. Hence, as |dx|, |dy| <= |Z| and |d| = 1,
//   m . q = s (m . d) + m . r >= -8 w M (|mx| + |my| + |mz|) - 11 w M (|mx| + |my|) >= -29 w M   if m . d >= 0
//   m . q                     >= -29 w M - sqrt(3) delta M                                       if m . d = -delta < 0
// But q is a mean of the three a, so m . q <= max m . a. The ray misses if
//   height = min m . (o - v) > 30 w M + 1.75 delta M,
// with 30 in place of 29 for terms of second order. m may be any vector; it need not be the exact normal of a sliver,
// which nobody knows.
//
// The offset reaches this height as follows. Let D be the largest m . (v - p) of the computed point p, and E the
// largest |v - p| on an axis. D is off by at most 4 w (|mx| + |my| + |mz|) E <= 7 w E (a subtraction, a product, two
// sums). The origin p + m f is rounded by at most w (|m| . |o| + f) along m, and |m|^2 > 1 - 16 w. So
// height >= f (1 - 20 w) - w |m| . |p| - D - 7 w E, and M <= E + 1.01 f. With R = 30 w + 1.75 delta <= 100 w, the
// condition is f (1 - 20 w - 1.01 R) >= D + w |m| . |p| + (7 w + R) E. The factor 1 + 2^-16 makes up for the bracket on
// the left, and for the rounding of f itself. The computed m . d is off by at most 3 w. A longer offset is enough as
// well: height grows faster with f than M does.
//
// Instances. The test sees the object-space ray (engine/tree/host/instance.h). Let M be the matrix now, A its inverse,
// T the translation, C the spread: the largest sum of a row of |M| times that of |A|. R is the largest |v - o| on an
// axis in the world. The theorem's numbers hold in the mesh's space, with an M there of at most the row sum of |A|
// times R: the point q' of an accepted hit is o' + s d' + r, s >= -8 w (row sum of |A|) R / |Z'|, |r| <= 11 w (row sum
// of |A|) R. In the world q = M q' + T is
//   q - o = s d + M r + M e_o + s M e_d
// where e_o and e_d are what rounding moves o' and d' by, at most 5 w sum_j |A_ij| |o_j - T_j| and
// 4 w sum_j |A_ij| |d_j|. So |M r| <= 11 w C R, |M e_o| <= 5 w C |o - T| and |s M e_d| <= 4.1 w C R on each axis; and
// as |d| <= (row sum of |M|) |Z'|, a negative s contributes 8 w C R on each. Along m three axes count sqrt(3) times:
//   height > w C (41 R + 9 |o - T|) + 1.75 delta R
// is enough. The vertices are off by instance_error(). With R <= E + 1.01 f and |o - T| <= |p - T| + 1.01 f the
// condition is
//   f (1 - 20 w - 51 w C - 1.8 delta) >= D + w |m| . |p| + ((7 + 49 C) w + 1.75 delta) E + 17 w C |p - T| + 2 w |T|.
// C is at most 4096 (kMostSpread), so the bracket is at least 0.9875: the factor is 1.013.
#include "error.glsl"

// Returns the offset for unit normal m on the origin's side and for a ray whose cosine to m is given.
float proved_offset(Surface s, vec3 m, float cosine) {
#if BALLOT_HAS_SHAPES
  if (s.shape) return 1.5 * shape_error(s);  // a ray that leans towards a flat shape sinks by 32 w of its extent
#endif
  precise vec3 a = s.v0 - s.position, b = s.v1 - s.position, c = s.v2 - s.position;
  float extent = max(largest(a), max(largest(b), largest(c)));
  float above = max(max(exact_dot(m, a), max(exact_dot(m, b), exact_dot(m, c))), 0.0);
  precise float delta = clamp(4.0 * W - cosine, 0.0, 40.0 * W);
#if BALLOT_HAS_INSTANCES
  precise vec3 from = s.position - s.shift;
  precise float moved = (8.0 + 42.0 * s.spread) * W * extent + 10.0 * s.spread * W * largest(from);
  precise float room =
      moved + instance_error(s, extent) + 1.75 * delta * extent + W * exact_dot(abs(m), abs(s.position));
  precise float offset = (above + room) * 1.013;
#else
  precise float room = (37.0 * W + 1.75 * delta) * extent + W * exact_dot(abs(m), abs(s.position));
  precise float offset = (above + room) * 1.0000153;
#endif
  return offset;
}
