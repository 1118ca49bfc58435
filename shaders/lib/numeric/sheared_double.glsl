// A triangle in double, sheared onto a ray's main axis (lib/numeric/triangle_double.glsl): edge functions with their
// exact sign, t and weights.

// Returns a * b - c * d with the exact sign and a relative error of at most 2^-51: zero only if the products are equal.
// Each product is a sum of two doubles: T. J. Dekker. A Floating-Point Technique for Extending the Available Precision.
// Numerische Mathematik 18, 1971. Where high and low parts cancel their sum is exact.
double difference_of_doubles(double a, double b, double c, double d) {
  const double split = 134217729.0lf;  // 2^27 + 1
  precise double split_a = a * split, split_b = b * split, split_c = c * split, split_d = d * split;
  precise double a1 = split_a - (split_a - a), b1 = split_b - (split_b - b), c1 = split_c - (split_c - c),
                 d1 = split_d - (split_d - d);
  precise double a0 = a - a1, b0 = b - b1, c0 = c - c1, d0 = d - d1;
  precise double ab = a * b, cd = c * d;
  precise double ab_low = ((a1 * b1 - ab) + a1 * b0 + a0 * b1) + a0 * b0;
  precise double cd_low = ((c1 * d1 - cd) + c1 * d0 + c0 * d1) + c0 * d0;
  precise double high = ab - cd, low = ab_low - cd_low;
  precise double back = high - ab, low_back = low - ab_low;
  precise double lost = (ab - (high - back)) - (cd + back);
  precise double low_lost = (ab_low - (low - low_back)) - (cd_low + low_back);
  precise double sum = (high + (lost + low)) + low_lost;
  return sum;
}

struct Sheared {
  dvec3 x, y;     // of the three vertices, across the main axis
  dvec3 edges;    // edge functions
  double det, t;
  dvec3 weights;  // of the vertices
};

struct DoubleCorners {
  dvec3 v0, v1, v2;
};

#if BALLOT_DOUBLES
#if BALLOT_FETCH == FETCH_TEXEL
layout(set = 0, binding = BIND_DOUBLES) uniform usamplerBuffer double_texels;
uvec4 double_texel(uint i) { return texelFetch(double_texels, int(i)); }
#else
layout(set = 0, binding = BIND_DOUBLES, std430) readonly buffer DoubleTexels { uvec4 double_texels[]; };
uvec4 double_texel(uint i) { return double_texels[i]; }
#endif
#if BALLOT_INSTANCES
uint first_double;  // of the mesh that is walked: set by enter_mesh()
#else
const uint first_double = 1u;
#endif

// `texel`: the triangle's first in the array of leaves.
DoubleCorners corners_in_double(uint texel) {
  uint at = first_double + 5u * leaf_texel(texel).w;
  dvec2 a = doubles_of(double_texel(at)), b = doubles_of(double_texel(at + 1u)), c = doubles_of(double_texel(at + 2u)),
        d = doubles_of(double_texel(at + 3u)), e = doubles_of(double_texel(at + 4u));
  return DoubleCorners(dvec3(a, b.x), dvec3(b.y, c), dvec3(d, e.x));
}
#else
DoubleCorners corners_in_double(uint texel) {
  Corners c = corners_of(fetch_triangle(texel, AS_STORED));
  return DoubleCorners(widen(c.v0), widen(c.v1), widen(c.v2));
}
#endif

Sheared shear(RaySpace space, DoubleCorners c) {
  precise dvec3 a = turned_to(space.axis, c.v0) - space.origin, b = turned_to(space.axis, c.v1) - space.origin,
                d = turned_to(space.axis, c.v2) - space.origin;
  dvec3 z = dvec3(a.z, b.z, d.z);
  precise dvec3 x = dvec3(a.x, b.x, d.x) + space.first * z, y = dvec3(a.y, b.y, d.y) + space.second * z;
  Sheared s;
  s.x = x;
  s.y = y;
  s.edges = dvec3(difference_of_doubles(x.z, y.y, y.z, x.y), difference_of_doubles(x.x, y.z, y.x, x.z),
                  difference_of_doubles(x.y, y.x, y.y, x.x));
  precise double det = s.edges.x + s.edges.y + s.edges.z;
  precise double inverse = 1.0lf / (det == 0.0lf ? 1.0lf : det);
  precise dvec3 weights = s.edges * inverse;
  precise double t = (weights.z * z.z + (weights.y * z.y + weights.x * z.x)) / space.along;
  s.det = det;
  s.t = t;
  s.weights = weights;
  return s;
}

// Returns true if the ray's line meets the closed triangle, whose plane is not parallel to it.
bool meets(Sheared s) {
  double least = min(s.edges.x, min(s.edges.y, s.edges.z)), most = max(s.edges.x, max(s.edges.y, s.edges.z));
  return (least >= 0.0lf || most <= 0.0lf) && s.det != 0.0lf;
}
