// Predicates of a ray and triangles, decided without rounding. All numbers are determinants |x y z| of vectors as the
// scene and the ray give them, with d the direction, o the origin and v0, v1, v2 the vertices:
//
//   side of vertex i = |d a b| + |d o a| + |d b o|                       a, b: the next two vertices, in turn
//   det   = |d v0 v1| + |d v1 v2| + |d v2 v0|                            = the sum of the sides
//   depth = |v0 v1 v2| + |o v1 v0| + |o v2 v1| + |o v0 v2|
//
// A side is the weight of its vertex times det, and depth is t times det (Rafael Segura, Francisco Feito. Algorithms to
// test ray-triangle intersection. WSCG 2001, with p_i = v_i - o multiplied out). So the ray meets the closed triangle
// if det is not zero and no two sides have opposite signs.
#include "fixed_point.glsl"

// Places of vectors in sum_numbers: d, o, v0 v1 v2, and the vertices of the best hit.
const uint ROW_DIR = 0u, ROW_ORIGIN = 1u, ROW_FIRST = 2u, ROW_BEST = 5u;

void set_row(uint row, vec3 v) {
  for (uint i = 0u; i < 3u; ++i) sum_numbers[row * 3u + i] = floatBitsToUint(v[i]);
}

uint next_of_three(uint i) { return i == 2u ? 0u : i + 1u; }

// Returns the rows of the k-th determinant of quantity q.
uvec3 determinant_rows(uint q, uint k) {
  uint i = k == 3u ? 0u : k, j = next_of_three(i);
  if (q < 3u) {  // a side
    uint a = ROW_FIRST + next_of_three(q), b = ROW_FIRST + next_of_three(next_of_three(q));
    return k == 0u ? uvec3(ROW_DIR, a, b) : k == 1u ? uvec3(ROW_DIR, ROW_ORIGIN, a) : uvec3(ROW_DIR, b, ROW_ORIGIN);
  }
  uint first = q < 5u ? ROW_FIRST : ROW_BEST;
  if ((q & 1u) == 0u) return uvec3(ROW_DIR, first + i, first + j);  // det
  return k == 0u ? uvec3(first, first + 1u, first + 2u)
                 : uvec3(ROW_ORIGIN, first + next_of_three(k - 1u), first + k - 1u);
}

// Computes a quantity in the sum that begins at `at`, and returns the result of finish_sum. Quantities 0 to 2 are the
// triangle's sides, 3 is its depth, 4 its det, 5 the best hit's depth, 6 its det.
//
// Unrolled, the loops are slower on lavapipe, which runs their body at least once for every leaf.
double exact_quantity(uint q, uint at) {
  clear_digits(at, sum_length + 1u);
  uint count = q == 3u || q == 5u ? 4u : 3u;
  for (uint k = 0u; k < count; ++k) {
    uvec3 row = determinant_rows(q, k) * 3u;
    [[dont_unroll]] for (uint i = 0u; i < 3u; ++i) {
      uvec2 j = uvec2(next_of_three(i), next_of_three(next_of_three(i)));
      [[dont_unroll]] for (uint swaps = 0u; swaps < 2u; ++swaps) {
        add_product(at, sum_numbers[row.x + i], sum_numbers[row.y + j.x], sum_numbers[row.z + j.y], swaps == 1u);
        j = j.yx;
      }
    }
  }
  return finish_sum(at);
}
