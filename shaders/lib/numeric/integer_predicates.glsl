// The predicates of exact_predicates.glsl for numbers of similar size, in integers of fixed size, which stay in
// registers.
//
// If all points are integers below 2^30 in one unit, and the direction below 2^60 in another, then differences of
// points fit 32 bits, components of their cross products 64, and sides, det and depth 128: det is the largest, and
// below 9 * 2^63 * 2^60 < 2^127. Integers are in two's complement, the lowest word first. With a, b, c = v0 - o,
// v1 - o, v2 - o, the sides are |d b c|, |d c a| and |d a b|, det is their sum, and depth is |a b c|.
//
// Values are the 53 leading bits, as those of finish_sum(), so a hit does not depend on which of the two found it.

const int POINT_BITS = 30, DIRECTION_BITS = 60;

// Returns the integer that x is in the unit 2^base.
uvec2 int64_of(float x, int base) {
  uint bits = floatBitsToUint(x), m = mantissa_of(bits);
  if (m == 0u) return uvec2(0u);
  int shift = exponent_of(bits) - base;
  uint left = uint(max(shift, 0)), right = uint(max(-shift, 0));
  uint low = m >> right;
  uvec2 size = left < 32u ? uvec2(low << left, (low >> 1) >> (31u - left)) : uvec2(0u, low << (left - 32u));
  return bits >> 31 == 0u ? size : uvec2(0u - size.x, ~size.y + uint(size.x == 0u));
}
ivec3 int32_of(vec3 v, int base) {
  return ivec3(int64_of(v.x, base).x, int64_of(v.y, base).x, int64_of(v.z, base).x);
}

uvec2 int64_of(int x) { return uvec2(x, x >> 31); }

uvec2 difference64(uvec2 a, uvec2 b) {
  uint borrow, low = usubBorrow(a.x, b.x, borrow);
  return uvec2(low, a.y - b.y - borrow);
}

uvec4 sum128(uvec4 a, uvec4 b) {
  uint x, y, more, z, carry;
  uvec4 sum;
  sum.x = uaddCarry(a.x, b.x, x);
  sum.y = uaddCarry(uaddCarry(a.y, b.y, y), x, more);
  sum.z = uaddCarry(uaddCarry(a.z, b.z, z), y | more, carry);
  sum.w = a.w + b.w + (z | carry);
  return sum;
}

// Returns a * b - c * d, which must fit 64 bits.
uvec2 difference_of_products(int a, int b, int c, int d) {
  int high, low, other_high, other_low;
  imulExtended(a, b, high, low);
  imulExtended(c, d, other_high, other_low);
  return difference64(uvec2(low, high), uvec2(other_low, other_high));
}

uvec4 product128(uvec2 a, uvec2 b) {
  uvec4 high, low;
  umulExtended(a.xxyy, b.xyxy, high, low);
  uvec4 product = sum128(sum128(uvec4(low.x, high.x, low.w, high.w), uvec4(0u, low.y, high.y, 0u)),
                         uvec4(0u, low.z, high.z, 0u));
  // A negative factor stands for itself plus 2^64.
  product.zw = difference64(product.zw, int(a.y) < 0 ? b : uvec2(0u));
  product.zw = difference64(product.zw, int(b.y) < 0 ? a : uvec2(0u));
  return product;
}

// A triangle as a ray sees it, relative to the ray's origin.
struct IntegerSight {
  double side[3];  // 53 leading bits
  uvec4 det, depth;
};

uvec4 magnitude_of(uvec4 a) { return int(a.w) < 0 ? sum128(~a, uvec4(1u, 0u, 0u, 0u)) : a; }
int sign_of(uvec4 a) { return int(a.w) < 0 ? -1 : a == uvec4(0u) ? 0 : 1; }

double leading_bits(uvec4 a) {
  uvec4 m = magnitude_of(a);
  int place = m.w != 0u ? 3 : m.z != 0u ? 2 : m.y != 0u ? 1 : 0;
  uvec3 top = place == 3 ? m.wzy : place == 2 ? m.zyx : place == 1 ? uvec3(m.yx, 0u) : uvec3(m.x, 0u, 0u);
  double size = leading_bits(top, place);
  return int(a.w) < 0 ? -size : size;
}

uvec4 dot128(uvec2 a[3], uvec2 b[3]) {
  return sum128(sum128(product128(a[0], b[0]), product128(a[1], b[1])), product128(a[2], b[2]));
}

IntegerSight measure(ivec3 o, uvec2 d[3], ivec3 v0, ivec3 v1, ivec3 v2) {
  ivec3 from[3] = ivec3[3](v0 - o, v1 - o, v2 - o);
  uvec2 normal[3];
  IntegerSight s;
  s.det = uvec4(0u);
  for (uint i = 0u; i < 3u; ++i) {
    ivec3 a = from[next_of_three(i)], b = from[next_of_three(next_of_three(i))];
    normal = uvec2[3](difference_of_products(a.y, b.z, a.z, b.y), difference_of_products(a.z, b.x, a.x, b.z),
                      difference_of_products(a.x, b.y, a.y, b.x));
    uvec4 side = dot128(d, normal);
    s.side[i] = leading_bits(side);
    s.det = sum128(s.det, side);
  }
  uvec2 last[3] = uvec2[3](int64_of(from[2].x), int64_of(from[2].y), int64_of(from[2].z));
  s.depth = dot128(last, normal);
  return s;
}

// Returns the order of |a| * |d| and |b| * |c|: -1, 0 or 1.
int compare_products(uvec4 a, uvec4 d, uvec4 b, uvec4 c) {
  a = magnitude_of(a);
  b = magnitude_of(b);
  c = magnitude_of(c);
  d = magnitude_of(d);
  uint a_words[4] = uint[4](a.x, a.y, a.z, a.w), b_words[4] = uint[4](b.x, b.y, b.z, b.w);
  uint c_words[4] = uint[4](c.x, c.y, c.z, c.w), d_words[4] = uint[4](d.x, d.y, d.z, d.w);
  uvec3 column = uvec3(0u);  // two's complement
  bool rest = false;
  for (int k = 0; k < 7; ++k) {
    for (int i = max(k - 3, 0); i <= min(k, 3); ++i) {
      add_wide(column, a_words[i], d_words[k - i]);
      column = ~column;  // ~(~x + y) is x - y
      add_wide(column, b_words[i], c_words[k - i]);
      column = ~column;
    }
    rest = rest || column.x != 0u;
    column = uvec3(column.yz, uint(int(column.z) >> 31));
  }
  return int(column.z) < 0 ? -1 : rest || column != uvec3(0u) ? 1 : 0;
}
