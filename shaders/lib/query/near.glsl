// The distance of a point from a triangle, and of a point from a box that may hold it, for the kernels that ask for
// triangles near a point. A kernel includes this file after lib/frame/kernel.glsl. shaders/query/closest_point.comp has
// the source, and the proof of all bounds.
#if BALLOT_INSTANCES
Corners moved_corners(TriangleTexels triangle);
#define CORNERS_OF moved_corners
#endif
#include "frame.glsl"
#if BALLOT_INSTANCES
#include "point_instances.glsl"
#define PRIM_OF(texel) (first_prim + leaf_texel(texel).w)
#define OUTSIDE_OF(p, box) outside_of_moved(box)
#else
#define PRIM_OF(texel) leaf_texel(texel).w
#define OUTSIDE_OF(p, box) outside_of(p, box)
#endif

const float LEAST_NORMAL = 3.155444e-30;  // 2^-98
const float LEAST_EDGE2 = 1.972152e-31;   // 2^-102

float square(vec3 v) {
  precise float sum = v.x * v.x + v.y * v.y + v.z * v.z;
  return sum;
}
float dot_of(vec3 a, vec3 b) {
  precise float sum = a.x * b.x + a.y * b.y + a.z * b.z;
  return sum;
}
vec3 cross_of(vec3 a, vec3 b) {
  precise vec3 c = vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
  return c;
}

// An edge from p to q, relative to the probe: the parts of its ends and its nearest inner point.
struct Side {
  float at_p, at_q;  // the foot lies between the ends if both are positive; their sum is the squared length
  vec3 foot;
  bool between;
};

Side side_of(vec3 p, vec3 q, vec3 e) {
  Side s;
  s.at_p = -dot_of(p, e);
  s.at_q = dot_of(q, e);
  float length2 = s.at_p + s.at_q;
  s.between = s.at_p > 0.0 && s.at_q > 0.0 && length2 > LEAST_EDGE2;
  precise float inverse = 1.0 / length2;
  precise vec3 foot = p * (s.at_q * inverse) + q * (s.at_p * inverse);
  s.foot = foot;
  return s;
}

// The nearest point of a triangle, relative to the probe and scaled.
struct Near {
  float distance2;
  Side ab, bc, ca;
  vec3 normal;      // scaled, of no certain length; zero if the triangle has no area
  float depth;      // normal . a
  float normal2;    // square of the normal
  float plane;      // squared distance from the plane
  vec3 sides;       // of the edges bc, ca, ab: negative inside; zero where `inside` is false
  bool inside;      // the nearest point is inside the triangle
};

Near nearest_of(Around t) {
  Near n;
  n.ab = side_of(t.a, t.b, t.ab);
  n.bc = side_of(t.b, t.c, t.bc);
  n.ca = side_of(t.c, t.a, t.ca);
  vec3 normal = vec3(difference_of_products(t.ab.y, t.bc.z, t.ab.z, t.bc.y),
                     difference_of_products(t.ab.z, t.bc.x, t.ab.x, t.bc.z),
                     difference_of_products(t.ab.x, t.bc.y, t.ab.y, t.bc.x));
  vec3 sizes = abs(normal);
  float size = max(sizes.x, max(sizes.y, sizes.z));
  normal *= size > LEAST_NORMAL ? scale_for(size, 0u) : 0.0;
  n.normal = normal;
  n.normal2 = square(normal);
  n.depth = dot_of(normal, t.a);
  n.sides = vec3(dot_of(cross_of(normal, t.bc), t.b), dot_of(cross_of(normal, t.ca), t.c),
                 dot_of(cross_of(normal, t.ab), t.a));
  float ab = n.ab.at_p + n.ab.at_q, bc = n.bc.at_p + n.bc.at_q, ca = n.ca.at_p + n.ca.at_q;
  bool beside = ab >= bc && ab >= ca ? n.ab.between : bc >= ca ? n.bc.between : n.ca.between;
  n.inside = beside && n.normal2 > 0.0 && larger(larger(n.sides.x, n.sides.y), n.sides.z) <= 0.0;
  float best = smaller(square(t.a), smaller(square(t.b), square(t.c)));
  best = smaller(best, n.ab.between ? square(n.ab.foot) : FARTHEST);
  best = smaller(best, n.bc.between ? square(n.bc.foot) : FARTHEST);
  best = smaller(best, n.ca.between ? square(n.ca.foot) : FARTHEST);
  precise float plane = n.depth * n.depth / n.normal2;
  n.plane = plane;
  n.distance2 = smaller(best, n.inside ? plane : FARTHEST);
  return n;
}

Around around(Probe p, uint texel) {
  TriangleTexels triangle = fetch_triangle(texel, AS_STORED);
  Corners v = CORNERS_OF(triangle), at = corners_around(p, triangle);
  precise vec3 a = v.v0 * p.scale, b = v.v1 * p.scale, c = v.v2 * p.scale;
  precise vec3 ab = b - a, bc = c - b, ca = a - c;
  return Around(at.v0, at.v1, at.v2, ab, bc, ca);
}

#if BALLOT_SHAPES
// The nearest point of a shape, in the space of its mesh (lib/query/point_instances.glsl).
struct ShapeNear {
  vec3 to;         // from the point that is asked about
  vec3 normal;     // outward
  float distance;  // in the world
};

ShapeNear shape_near(uint texel) {
  ShapeNear n;
  n.to = shape_foot(fetch_shape(leaf_texel(texel).w), shape_point, n.normal);
  n.distance = length_of(n.to) * shape_stretch;
  return n;
}

float shape_distance2(Probe p, uint texel) {
  precise float d = shape_near(texel).distance * p.scale;
  return d * d;
}
#define DISTANCE2_OF(p, texel) \
  (walks_shapes() ? shape_distance2(p, texel) : nearest_of(around(p, texel)).distance2)
#else
#define DISTANCE2_OF(p, texel) nearest_of(around(p, texel)).distance2
#endif

float box_distance2(Probe p, NodeBox box) {
  vec3 d = OUTSIDE_OF(p, box) * p.scale;
  return square(d);
}

// Returns true for 0 to infinity. Tests the bits, because a device may take a denormal negative limit for 0.
bool is_limit(float limit) {
  uint bits = floatBitsToUint(limit);
  return bits <= 0x7F800000u || bits == 0x80000000u;
}

// Returns a square, scaled, that no distance within the limit exceeds.
float limit_distance2(Probe p, float limit) {
  float scaled_limit = limit * p.scale;  // infinite where it is out of range
  return smaller(scaled_limit * scaled_limit * 1.000001, FARTHEST);
}
