// The unit normal of a triangle, with the bits of unit_normal() of engine/core/unit_normal.h, which says what it is.
// Sums and products of double alone: devices round these as hosts do.
#include "../numeric/expansion.glsl"
#include "../numeric/float_bits.glsl"

double exact_sum(double terms[6]) {
  expand(terms);
  precise double all = 0.0lf;
  for (uint i = 0u; i < 6u; ++i) all = all + terms[i];
  return all;
}

bool is_exact_difference(dvec3 difference, dvec3 a, dvec3 b) {
  precise dvec3 back = a - difference, sum = difference + back;
  return all(equal(back, b)) && all(equal(sum, a));
}

double inverse_root(double x) {
  precise double y = packDouble2x32(uvec2(0u, 0x5FE6EB50u - (unpackDouble2x32(x).y >> 1))), half_x = 0.5lf * x;
  for (uint step = 0u; step < 4u; ++step) y = y * (1.5lf - half_x * (y * y));
  return y;
}

// Returns the bits of a number, as float32. Zeros have no sign.
uint narrow_bits(double value) {
  uint bits = floatBitsToUint(narrow(value));
  return bits == 0x80000000u ? 0u : bits;
}

// Returns a vector at length 1, as the bits of three numbers; zero for zero.
uvec3 unit_bits(dvec3 n) {
  precise double square = n.x * n.x + n.y * n.y + n.z * n.z;
  if (square == 0.0lf) return uvec3(0u);
  precise dvec3 unit = n * inverse_root(square);
  return uvec3(narrow_bits(unit.x), narrow_bits(unit.y), narrow_bits(unit.z));
}

// Returns the cross product of the edges that leave the first vertex.
dvec3 area_vector(vec3 vertex_a, vec3 vertex_b, vec3 vertex_c) {
  precise dvec3 a = widen(vertex_a), b = widen(vertex_b), c = widen(vertex_c), e = b - a, f = c - a;
  precise dvec3 x = e.yzx * f.zxy, y = e.zxy * f.yzx, n = x - y, least = 0.0009765625lf * (abs(x) + abs(y));
  if (!(is_exact_difference(e, b, a) && is_exact_difference(f, c, a) && all(greaterThanEqual(abs(n), least))))
    for (uint i = 0u; i < 3u; ++i) {
      a = a.yzx, b = b.yzx, c = c.yzx;
      precise double terms[6] = double[6](b.x * c.y, -(b.y * c.x), c.x * a.y, -(c.y * a.x), a.x * b.y, -(a.y * b.x));
      n[i] = exact_sum(terms);
    }
  return n;
}

// Returns the bits of the three numbers.
uvec3 unit_normal(vec3 a, vec3 b, vec3 c) { return unit_bits(area_vector(a, b, c)); }
