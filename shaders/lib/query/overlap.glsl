// Whether a triangle and a box with sides along the axes have a point in common, both closed: decided, or left open.
//
// They are apart if and only if they are so along one of 13 axes: those of the box, the triangle's normal, and the
// products of an edge and an axis of the box (Akenine-Moller. Fast 3D triangle-box overlap testing. Journal of Graphics
// Tools 6(1), 2001). A triangle without area is a segment or a point, whose other axes are zero and tell nothing.
//
// Along the axes of the box floats are compared as integers of the same order: that is exact. The other axes take
// differences of coordinates, each rounded once, times a power of two that brings the largest into [1/2, 1). With
// w = 2^-24 for a device that rounds to nearest and 2^-23 for one that cuts:
//   Edges. A value is e_i d_j - e_j d_i, its error 4 w of the sizes of its two products: a factor w each, the product
//   and the difference. EDGE_ROOM is 8 * 2^-23.
//   Normal. A part of it is off by 4 w of the sizes of its two products, N_k; times d_k and summed up, 8 w of the sum
//   of N_k |d_k|. NORMAL_ROOM is 16 * 2^-23. Where the sign of a part is not sure, either corner may be the farthest:
//   the larger |d_k| counts.
// All that holds while nothing underflows: if each difference is 0, or at least 2^-60 of the largest, which is in
// [2^-40, 2^100]. Products of two then are above 2^-120; those of three lose less than NORMAL_LOST. A difference is 0
// only where the coordinates are equal, which the integers tell. Else the triangle is open, unless the box's own axes
// tell it apart. So a value of exactly 0 is one: a box that touches a triangle along an axis is decided here.
#define APART 0u
#define OVERLAPS 1u
#define OPEN 2u

const float EDGE_ROOM = 9.5367432e-7;     // 2^-20
const float NORMAL_ROOM = 1.9073486e-6;   // 2^-19
const float NORMAL_LOST = 1.5046328e-36;  // 2^-119

struct Solid {
  vec3 lo, hi;
  ivec3 lo_order, hi_order;
};

// Returns integers in the order of numbers, which are no NaN. Both zeros are 0.
ivec3 order_of(vec3 v) {
  ivec3 bits = floatBitsToInt(v);
  return mix(bits, ivec3(int(0x80000000u)) - bits, lessThan(bits, ivec3(0)));
}

Solid solid_of(vec3 lo, vec3 hi) { return Solid(lo, hi, order_of(lo), order_of(hi)); }

// Differences of coordinates: their largest and least sizes that are not 0, and whether all zeros are exact.
float largest_size, least_size;
bool zeros_exact;

vec3 apart_of(vec3 a, ivec3 a_order, vec3 b, ivec3 b_order) {
  precise vec3 d = a - b;
  vec3 size = abs(d);
  bvec3 zero = equal(size, vec3(0.0));
  largest_size = max(largest_size, max(size.x, max(size.y, size.z)));
  vec3 some = mix(size, vec3(FARTHEST), zero);
  least_size = min(least_size, min(some.x, min(some.y, some.z)));
  bvec3 same = equal(a_order, b_order);
  zeros_exact = zeros_exact && all(equal(zero, same));
  return d;
}

// Returns what is known along the product of an axis of the box and an edge, in the plane of the two other axes. `lo`
// and `hi`: the box's corners from an end of the edge in xy, and from the third corner in zw.
uint along_edge(vec2 edge, vec4 lo, vec4 hi) {
  // Of the largest value from either, then of the least.
  vec4 y = edge.x >= 0.0 ? vec4(hi.yw, lo.yw) : vec4(lo.yw, hi.yw);
  vec4 x = edge.y >= 0.0 ? vec4(lo.xz, hi.xz) : vec4(hi.xz, lo.xz);
  precise vec4 p = edge.x * y, q = edge.y * x, value = p - q;
  vec4 room = EDGE_ROOM * (abs(p) + abs(q));
  bvec4 below = lessThan(value, -room), above = greaterThan(value, room);
  bvec4 not_below = greaterThanEqual(value, room), not_above = lessThanEqual(value, -room);
  if (below.x && below.y || above.z && above.w) return APART;
  return (not_below.x || not_below.y) && (not_above.z || not_above.w) ? OVERLAPS : OPEN;
}

uint along_edges(vec3 e, vec3 lo, vec3 hi, vec3 third_lo, vec3 third_hi) {
  uint x = along_edge(e.yz, vec4(lo.yz, third_lo.yz), vec4(hi.yz, third_hi.yz));
  uint y = along_edge(e.zx, vec4(lo.zx, third_lo.zx), vec4(hi.zx, third_hi.zx));
  uint z = along_edge(e.xy, vec4(lo.xy, third_lo.xy), vec4(hi.xy, third_hi.xy));
  return min(x, min(y, z)) == APART ? APART : max(x, max(y, z));
}

float normal_room(vec3 parts, vec3 d) {
  bool exact = all(equal(min(parts, d), vec3(0.0)));
  return exact ? 0.0 : NORMAL_ROOM * (parts.x * d.x + parts.y * d.y + parts.z * d.z) + NORMAL_LOST;
}

uint along_normal(vec3 ab, vec3 ca, vec3 lo, vec3 hi) {
  precise vec3 p = ca.yzx * ab.zxy, q = ca.zxy * ab.yzx, n = p - q;
  vec3 size = abs(p) + abs(q);
  bvec3 sure = greaterThan(abs(n), EDGE_ROOM * size), up = greaterThanEqual(n, vec3(0.0));
  vec3 far = mix(lo, hi, up), near = mix(hi, lo, up), farthest = max(abs(lo), abs(hi));
  vec3 most_far = mix(farthest, abs(far), sure), most_near = mix(farthest, abs(near), sure);
  precise float most = n.x * far.x + n.y * far.y + n.z * far.z, least = n.x * near.x + n.y * near.y + n.z * near.z;
  float room_far = normal_room(size, most_far), room_near = normal_room(size, most_near);
  if (most < -room_far || least > room_near) return APART;
  return most >= room_far && least <= -room_near ? OVERLAPS : OPEN;
}

uint overlap_of(Solid box, Corners v) {
  ivec3 a = order_of(v.v0), b = order_of(v.v1), c = order_of(v.v2);
  if (any(lessThan(max(a, max(b, c)), box.lo_order)) || any(greaterThan(min(a, min(b, c)), box.hi_order))) return APART;
  largest_size = 0.0;
  least_size = FARTHEST;
  zeros_exact = true;
  vec3 ab = apart_of(v.v1, b, v.v0, a), bc = apart_of(v.v2, c, v.v1, b), ca = apart_of(v.v0, a, v.v2, c);
  vec3 lo_a = apart_of(box.lo, box.lo_order, v.v0, a), hi_a = apart_of(box.hi, box.hi_order, v.v0, a);
  vec3 lo_b = apart_of(box.lo, box.lo_order, v.v1, b), hi_b = apart_of(box.hi, box.hi_order, v.v1, b);
  vec3 lo_c = apart_of(box.lo, box.lo_order, v.v2, c), hi_c = apart_of(box.hi, box.hi_order, v.v2, c);
  if (largest_size == 0.0 && zeros_exact) return OVERLAPS;
  bool in_range = largest_size >= 9.094947e-13 && largest_size <= 1.2676506e30;  // 2^-40, 2^100
  if (!in_range || !zeros_exact || least_size < largest_size * 8.6736174e-19) return OPEN;  // 2^-60
  float scale = scale_for(largest_size, 0u) * 0.5;
  ab *= scale, bc *= scale, ca *= scale;
  lo_a *= scale, hi_a *= scale, lo_b *= scale, hi_b *= scale, lo_c *= scale, hi_c *= scale;
  uint normal = along_normal(ab, ca, lo_a, hi_a);
  if (normal == APART) return APART;
  uint e0 = along_edges(ab, lo_a, hi_a, lo_c, hi_c), e1 = along_edges(bc, lo_b, hi_b, lo_a, hi_a),
       e2 = along_edges(ca, lo_c, hi_c, lo_b, hi_b);
  if (min(e0, min(e1, e2)) == APART) return APART;
  return max(max(normal, e0), max(e1, e2));
}
