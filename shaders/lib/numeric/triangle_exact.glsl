// Triangle test "exact": vertices, origin, direction, t_min and t_max are the real numbers that their bits stand for,
// and the result is that of arithmetic without rounding. A ray hits a triangle if the exact point lies in the closed
// triangle, the triangle's plane is not parallel to the ray, and t_min <= t <= t_max. The nearest hit has the smallest
// exact t, and the smallest prim where t is equal.
//
// There are three stages, each for what the one before left open. Stage 1, in float32, rejects triangles that the ray
// surely misses. Stage 2, in double, decides with a bound of its error. Stage 3, exact_decision.glsl, decides the
// rest. t, u and v come from double where signs are sure and errors below 2^-28, else from stage 3. Ray
// and triangle alone decide which, so all methods agree bit for bit. A kernel that lists all rays in doubt
// (lib/frame/doubtful.glsl) has no stage 3: a triangle that double does not decide stays open.
//
// Source of the plan: Jonathan Shewchuk. Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric
// Predicates. Discrete & Computational Geometry 18, 1997, section 1. Differs: the last stage adds fixed-point numbers,
// in sums as long as the numbers need. Kernels that take rays in doubt use integers of fixed size where these suffice.
//
// The first stage only marks triangles; the other stages run over the marked triangles of a leaf after it
// (settle_leaf). lavapipe runs both sides of every branch, and the body of a loop at least once, so rare work must not
// stand in the loop over triangles: with it there, rays took 2 to 3 times as long.

// The constants of a ray, and the nearest hit so far. The scaled ray is the given one in the units of ray_scale.glsl.
// The walked ray is the scaled one, started nearer to the scene if it begins far away (nearer_origin.glsl).
struct RaySpace {
  Ray given;                   // all decisions are about this ray; the walked ray serves boxes and the first stage
  vec3 row_x, row_y;           // rows of the matrix that shears the ray onto the axis of its largest component
  double best_t, best_error;   // of the nearest hit so far; its exact t is within the error
  uint best_texel;             // texel of its triangle; NO_HIT if there is none
  float reach;                 // t of the walked ray, not less than that of the best hit, or t_max if there is none
  float start;                 // t of the scaled ray where the walked ray starts (nearer_origin.glsl)
  float origin_room;           // added to distances from the walked ray's origin; 0 if it is exact
  double open_t;               // no triangle that was left open is hit before this t; NOTHING_OPEN without any
  uint first_texel, marked;    // texel of the leaf's first marked triangle; a bit for each marked one from there on
};
#define TRIANGLE_SETTLES
const double NOTHING_OPEN = 1e300lf;

// True if the range of a ray is empty, which makes it dead (lib/tree/leaf.glsl).
#define IS_EMPTY_RANGE(t_min, t_max) (widen(t_max) <= widen(t_min))

#include "../tree/leaf_vertices.glsl"
#include "nearer_origin.glsl"

float largest_of(vec3 v) { return max(v.x, max(v.y, v.z)); }

void change_ray();

RaySpace make_ray_space(inout Ray ray, Ray given) {
  vec3 d = ray.dir, a = abs(d);
  bool x = a.x >= a.y && a.x >= a.z, y = !x && a.y >= a.z;
  float main_axis = x ? d.x : y ? d.y : d.z;
  float first = -(x ? d.y : y ? d.z : d.x) / main_axis, second = -(x ? d.z : y ? d.x : d.y) / main_axis;
  RaySpace space;
  space.given = given;
  space.row_x = x ? vec3(first, 1.0, 0.0) : y ? vec3(0.0, first, 1.0) : vec3(1.0, 0.0, first);
  space.row_y = x ? vec3(second, 0.0, 1.0) : y ? vec3(1.0, second, 0.0) : vec3(0.0, 1.0, second);
  space.best_t = 0.0lf;
  space.best_error = 0.0lf;
  space.best_texel = NO_HIT;
  space.start = move_nearer(ray, given);
  space.origin_room = space.start > 0.0 ? 0.25 * largest_of(abs(ray.origin)) : 0.0;
  space.reach = walked_t(given, widen(given.t_max), 0.0lf, space.start);
  space.open_t = NOTHING_OPEN;
  space.first_texel = 0u;
  space.marked = 0u;
  change_ray();
  return space;
}

uint texel_order(RaySpace space) { return AS_STORED; }

// Nothing but the triangle and the ray's origin may be off.
#define SIZE_WITH_ROOM(m) m
#include "surely_missed.glsl"

double largest_magnitude(dvec3 v) { return max(abs(v.x), max(abs(v.y), abs(v.z))); }
double sum_of_products(dvec3 a, dvec3 b) {
  precise double sum = a.x * b.x + a.y * b.y + a.z * b.z;
  return sum;
}
dvec3 crossed(dvec3 a, dvec3 b) {
  precise dvec3 c = dvec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
  return c;
}

// A ray and a triangle in double: sides and depth as in exact_predicates.glsl, and t.
//
// The bounds, with w = 2^-53, a = v0 - o, and edges f = v1 - v0 and g = v2 - v0. A triple product |x y z| rounds by at
// most 7 w (d and two differences) or 8 w (three differences) of the sum of its six products' magnitudes, which is at
// most 2 |x|_1 |y|_max |z|_max. Let E be the largest component of f and g, and K = |d|_max E. Then sides 1 and 2 are
// off by 14 w |a|_1 K, det by 42 w K E, depth by 16 w |a|_1 E^2, and side 0, which is det minus the other two, by 60 w
// K E + 40 w |a|_1 K. The bounds below have room for their own rounding. Nothing leaves the range of double: numbers
// are 0 or at least 2^-447, and below 2^390.
struct DoubleSight {
  double side[3], side_error;
  double depth, t, error;  // error is infinite if det may be 0
  bool precise_values;
};

DoubleSight look(Ray ray, Corners corners) {
  const double tiny = 1.0lf / 268435456.0lf;  // 2^-28
  precise dvec3 d = widen(ray.dir), v0 = widen(corners.v0);
  precise dvec3 a = v0 - widen(ray.origin), f = widen(corners.v1) - v0, g = widen(corners.v2) - v0;
  dvec3 normal = crossed(f, g), moment = crossed(a, d);
  double det = sum_of_products(d, normal), depth = sum_of_products(a, normal);
  double e = max(largest_magnitude(f), largest_magnitude(g)), k = largest_magnitude(d) * e;
  double distance = abs(a.x) + abs(a.y) + abs(a.z);
  const double unit = 7.1054273576010019e-15lf;  // 2^-47
  double det_error = unit * k * e, depth_error = unit * 0.25lf * distance * e * e;
  DoubleSight s;
  precise double side1 = sum_of_products(g, moment), side2 = -sum_of_products(f, moment), side0 = det - side1 - side2;
  s.side = double[3](side0, side1, side2);
  s.side_error = unit * k * (e + distance);
  bool sure = abs(det) > 2.0lf * det_error;
  precise double t = depth / (sure ? det : 1.0lf);
  s.depth = depth;
  s.t = t;
  // t is off by at most (depth_error + |t| det_error) / |exact det|, plus the rounding of the quotient.
  s.error = sure ? 1.001lf * (depth_error + abs(t) * det_error) / (abs(det) - det_error) + 4.5e-16lf * abs(t)
                 : packDouble2x32(uvec2(0u, 0x7FF00000u));
  s.precise_values = sure && s.error <= tiny * abs(t) && s.side_error <= tiny * abs(det);
  return s;
}

// Extends a span of exponents so that it covers the set bits of a number. A span reaches from the exponent of the
// lowest set bit to one above that of the highest.
ivec2 with_bits(ivec2 span, float x) {
  uint bits = floatBitsToUint(x), m = mantissa_of(bits);
  int e = exponent_of(bits);
  return m == 0u ? span : ivec2(min(span.x, e + findLSB(m)), max(span.y, e + findMSB(m) + 1));
}
ivec2 with_bits(ivec2 span, vec3 v) { return with_bits(with_bits(with_bits(span, v.x), v.y), v.z); }
ivec2 with_bits(ivec2 span, Corners c) { return with_bits(with_bits(with_bits(span, c.v0), c.v1), c.v2); }
const ivec2 NO_BITS = ivec2(1000, -1000);

// Returns true if look() rounds only t, as in grids and boxes along the axes. There rays often meet edges, or lie in
// the planes of triangles. If points are integers below 2^15 in one unit, and the direction in another, differences are
// below 2^16, components of the normal below 2^33, of the moment below 2^32, and det, depth and sides below 2^52.
bool is_exact_in_double(Ray ray, Corners corners) {
  ivec2 points = with_bits(with_bits(NO_BITS, ray.origin), corners), dir = with_bits(NO_BITS, ray.dir);
  return points.y - points.x <= 15 && dir.y - dir.x <= 15;
}

// For a sight in which look() rounded only t: makes its error bounds 0, except that of t. Returns false if det is 0.
bool remove_rounding(inout DoubleSight s) {
  precise double det = s.side[0] + s.side[1] + s.side[2];
  bool meets = det != 0.0lf;
  precise double t = s.depth / (meets ? det : 1.0lf);
  s.side_error = 0.0lf;
  s.t = t;
  s.error = 4.5e-16lf * abs(t);
  s.precise_values = true;
  return meets;
}

// Returns true if surely no two of the sides have opposite signs. `missed` is true if two surely have.
bool sides_agree(DoubleSight s, out bool missed) {
  double most = max(s.side[0], max(s.side[1], s.side[2])), least = min(s.side[0], min(s.side[1], s.side[2]));
  missed = most > s.side_error && least < -s.side_error;
  return least > s.side_error || most < -s.side_error || (s.side_error == 0.0lf && !missed);
}

int sign_of(double x) { return x > 0.0lf ? 1 : x < 0.0lf ? -1 : 0; }

// The questions that double leaves open.
struct Doubt {
  bool values;  // sides, or t, u, v
  bool range;   // whether t lies in [t_min, t_max]
  bool order;   // whether the hit is nearer than the best one
};

// Returns the open questions. `missed` is true if there is surely no hit, or none before the best hit.
Doubt doubt_of(Ray ray, RaySpace space, uint prim, uint best_prim, DoubleSight s, out bool missed) {
  Doubt doubt;
  doubt.values = !sides_agree(s, missed) || !s.precise_values;
  double low = s.t - s.error, high = s.t + s.error, t_min = widen(ray.t_min), t_max = widen(ray.t_max);
  doubt.range = !(low >= t_min && high <= t_max);
  missed = missed || high < t_min || low > t_max;
  doubt.order = false;
#if !BALLOT_ANY_HIT
  if (best_prim != NO_HIT) {
    // Spatial splits put a triangle into several leaves.
    missed = missed || low > space.best_t + space.best_error || prim == best_prim;
    doubt.order = high >= space.best_t - space.best_error;
  }
#endif
  return doubt;
}

bool is_corner(vec3 v, Corners of) { return v == of.v0 || v == of.v1 || v == of.v2; }

// Returns true if two triangles that a ray hits are one triangle, whatever the order of their vertices.
bool coincide(Corners a, Corners b) { return is_corner(a.v0, b) && is_corner(a.v1, b) && is_corner(a.v2, b); }

#if BALLOT_DOUBTFUL == DOUBTFUL_LISTED
void change_ray() {}
#else
#include "exact_decision.glsl"
#endif

#include "marked_leaf.glsl"

// Decides whether the ray hits the triangle in range and before the best hit so far. If so, makes it the best hit.
void settle_triangle(inout RaySpace space, uint texel, inout Hit best) {
  Ray ray = space.given;
  Corners corners = corners_of(fetch_triangle(texel, AS_STORED));
  uint prim = leaf_texel(texel).w;
  DoubleSight s = look(ray, corners);
  bool missed;
  Doubt doubt = doubt_of(ray, space, prim, best.prim, s, missed);
  bool hit = !missed;
  uint decisions = hit && (doubt.values || doubt.range || doubt.order) ? 1u : 0u;
  for (uint i = 0u; i < decisions; ++i) {
    if (is_exact_in_double(ray, corners)) {
      bool meets = remove_rounding(s);
      doubt = doubt_of(ray, space, prim, best.prim, s, missed);
      hit = meets && !missed;
    }
#if !BALLOT_ANY_HIT
    // Copies of a triangle are hit at one t. There the smallest prim wins, and nothing has to be computed.
    if (doubt.order && coincide(corners, corners_of(fetch_triangle(space.best_texel, AS_STORED)))) {
      doubt.order = false;
      hit = hit && prim < best.prim;
    }
#endif
    uint left = hit && (doubt.values || doubt.range || doubt.order) ? 1u : 0u;
#if BALLOT_DOUBTFUL == DOUBTFUL_LISTED
    if (left != 0u) space.open_t = min(space.open_t, s.t - s.error);
    hit = hit && left == 0u;
#else
    for (uint j = 0u; j < left; ++j) {
#if BALLOT_DOUBTFUL == DOUBTFUL_LIMITED
      if (gives_up()) {
        hit = false;
        space.reach = -3.4e38;
        break;
      }
#endif
      hit = decide(space, corners, texel, prim, best.prim, doubt, s);
    }
#endif
  }
  precise double det = s.side[0] + s.side[1] + s.side[2], weight1 = s.side[1] / det, weight2 = s.side[2] / det;
#if BALLOT_DOUBTFUL == DOUBTFUL_LIMITED
  hit = hit && !has_given_up();  // a ray that has given up takes no more hits
#endif
  if (hit) {
    best = Hit(narrow(clamp(s.t, widen(ray.t_min), widen(ray.t_max))), prim, float(weight1), float(weight2));
    space.best_t = s.t;
    space.best_error = s.error;
    space.best_texel = texel;
    space.reach = walked_t(space.given, s.t, s.error, space.start);
  }
}

#if BALLOT_DOUBTFUL == DOUBTFUL_LIMITED
float open_from(RaySpace space) { return has_given_up() ? -3.4e38 : 3.4e38; }
bool is_open(RaySpace space, Hit best) { return has_given_up(); }
#else
// Returns a t before which no open triangle is hit, rounded by one ulp at most. It lies in [-3.4e38, 3.4e38]; the upper
// end means that none is open.
float open_from(RaySpace space) { return float(clamp(space.open_t, -3.4e38lf, 3.4e38lf)); }

// Returns true if an open triangle may be the nearest hit.
bool is_open(RaySpace space, Hit best) {
  if (best.prim == NO_HIT) return space.open_t < NOTHING_OPEN;
  return BALLOT_ANY_HIT == 0 && space.open_t <= space.best_t + space.best_error;
}
#endif
