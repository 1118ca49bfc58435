// Stage 3 of mode "exact": decides about a ray and a triangle without rounding, by sums of any size
// (exact_predicates.glsl). In most scenes numbers are of similar size, and integers of fixed size have room for them
// (integer_predicates.glsl). With integers the rays in doubt of Sponza take 0.13 ms instead of 0.27 on an H100, but so
// many registers that a kernel which also walks all rays slows down (diffuse rays 0.83). So only kernels that take rays
// in doubt have them.
#include "exact_predicates.glsl"
#if BALLOT_DOUBTFUL == DOUBTFUL_TAKEN
#include "integer_predicates.glsl"
#endif

// Sums 2 and 3 keep depth and det of a ray's best hit for the next triangle that is compared with it: where the ray
// hits many triangles at one t, as at a vertex, that saves half of the work. NOTE_TEXEL has the texel of their
// triangle, or NO_HIT, and NOTE_SIGN the sign of its t.
void forget_sums() { sum_digits[NOTE_TEXEL] = int(NO_HIT); }
bool has_sums_of(uint texel) { return sum_digits[NOTE_TEXEL] == int(texel); }
void note_sums(uint texel, int sign) {
  sum_digits[NOTE_TEXEL] = int(texel);
  sum_digits[NOTE_SIGN] = sign;
}

// A ray that hits many triangles at nearly one t, as at a vertex, may need hundreds of decisions, while the rays beside
// it wait. With DOUBTFUL_LIMITED a ray has few, then gives up: its walk ends, and it is listed.
const int MOST_DECISIONS = 8;
void change_ray() {
  forget_sums();
  sum_digits[NOTE_DECISIONS] = 0;
}
bool has_given_up() { return sum_digits[NOTE_DECISIONS] > MOST_DECISIONS; }
bool gives_up() {
  ++sum_digits[NOTE_DECISIONS];
  return has_given_up();
}

// Sets the rows of exact_predicates.glsl, and the size of sums. Forgets kept sums of another size.
void set_rows(Ray ray, RaySpace space, Corners corners, bool order) {
  set_row(ROW_DIR, ray.dir);
  set_row(ROW_ORIGIN, ray.origin);
  set_row(ROW_FIRST, corners.v0);
  set_row(ROW_FIRST + 1u, corners.v1);
  set_row(ROW_FIRST + 2u, corners.v2);
  if (order) {
    Corners best = corners_of(fetch_triangle(space.best_texel, AS_STORED));
    set_row(ROW_BEST, best.v0);
    set_row(ROW_BEST + 1u, best.v1);
    set_row(ROW_BEST + 2u, best.v2);
  }
  if (!size_sums(order ? 24u : 15u, !has_sums_of(NO_HIT))) forget_sums();
}

// Decides by sums of any size.
bool decide_by_sums(Ray ray, RaySpace space, Corners corners, uint texel, uint prim, uint best_prim, Doubt doubt,
                    inout DoubleSight s) {
  set_rows(ray, space, corners, doubt.order);
  bool add_best = doubt.order && !has_sums_of(space.best_texel);
  // The sides have one sign if all but zeros have.
  double most = 0.0lf, least = 0.0lf, depth = 0.0lf;
  bool hit = true;
  int sign = 0;
  uint q = doubt.values ? 0u : 3u, end = add_best ? 7u : 5u;
  while (q < end) {
    double value = exact_quantity(q, q < 3u ? 0u : (q - 3u) * SUM_DIGITS);
    if (q < 3u) {
      s.side[q] = value;
      most = max(most, value);
      least = min(least, value);
    }
    if (q == 4u && doubt.values) {
      precise double t = depth / value;
      s.t = t;
      s.error = 1e-13lf * abs(t);
    }
    if ((q & 1u) != 0u) depth = value;
    if (q == 4u) sign = sign_of(depth) * sign_of(value);
    if (q == 6u) note_sums(space.best_texel, sign_of(depth) * sign_of(value));
    ++q;
    if (q == 3u) {
      hit = !(most > 0.0lf && least < 0.0lf) && !(most == 0.0lf && least == 0.0lf);
      if (!hit) end = q;
    }
  }
  if (!hit) return false;
  // Compares t with the best hit, then with t_min, then with t_max.
  uint against = doubt.order ? 0u : 1u, last = doubt.range ? 3u : 1u;
  while (against < last) {
    uint at = 2u * SUM_DIGITS, step = SUM_DIGITS, count = sum_words;
    int other = sum_digits[NOTE_SIGN];
    if (against > 0u) {
      float bound = against == 1u ? ray.t_min : ray.t_max;
      at = FRACTION_AT;
      step = FRACTION_WORDS;
      count = set_fraction(floatBitsToUint(bound));
      other = sign_of(widen(bound));
    }
    int order = sign < other ? -1 : 1;
    if (sign == other) order = sign * compare_fractions(at, at + step, count);
    bool kept = against == 0u ? order < 0 || (order == 0 && prim < best_prim) : against == 1u ? order >= 0 : order <= 0;
    hit = hit && kept;
    ++against;
  }
  if (hit) {
    for (uint i = 0u; i < sum_words; ++i) {
      sum_digits[2u * SUM_DIGITS + i] = sum_digits[i];
      sum_digits[3u * SUM_DIGITS + i] = sum_digits[SUM_DIGITS + i];
    }
    note_sums(texel, sign);
  }
  return hit;
}

#if BALLOT_DOUBTFUL == DOUBTFUL_TAKEN
// The same in integers. `points` and `directions` are the spans of their bits. Cannot tell whether t is in range.
bool decide_in_integers(RaySpace space, Corners corners, Corners best, uint prim, uint best_prim, Doubt doubt,
                        ivec2 points, ivec2 directions, inout DoubleSight s) {
  Ray ray = space.given;
  uvec2 d[3] = uvec2[3](int64_of(ray.dir.x, directions.x), int64_of(ray.dir.y, directions.x),
                        int64_of(ray.dir.z, directions.x));
  ivec3 o = int32_of(ray.origin, points.x);
  IntegerSight sight[2];
  for (uint i = 0u; i < (doubt.order ? 2u : 1u); ++i) {
    Corners c = i == 0u ? corners : best;
    sight[i] = measure(o, d, int32_of(c.v0, points.x), int32_of(c.v1, points.x), int32_of(c.v2, points.x));
  }
  double side[3] = sight[0].side;
  double most = max(side[0], max(side[1], side[2])), least = min(side[0], min(side[1], side[2]));
  if ((most > 0.0lf && least < 0.0lf) || (most == 0.0lf && least == 0.0lf)) return false;
  if (doubt.values) {
    s.side = side;
    precise double t = leading_bits(sight[0].depth) / leading_bits(sight[0].det) *
                       packDouble2x32(uvec2(0u, uint(1023 + points.x - directions.x) << 20));
    s.t = t;
    s.error = 1e-13lf * abs(t);
  }
  if (!doubt.order) return true;
  int sign = sign_of(sight[0].depth) * sign_of(sight[0].det), other = sign_of(sight[1].depth) * sign_of(sight[1].det);
  int order = sign < other ? -1 : 1;
  if (sign == other) order = sign * compare_products(sight[0].depth, sight[1].det, sight[0].det, sight[1].depth);
  return order < 0 || (order == 0 && prim < best_prim);
}
#endif

// Decides without rounding. Returns true if the triangle at `texel` is hit in range and before the best hit. `s` gets
// precise values if they are asked for.
bool decide(RaySpace space, Corners corners, uint texel, uint prim, uint best_prim, Doubt doubt,
            inout DoubleSight s) {
  Ray ray = space.given;
#if BALLOT_DOUBTFUL == DOUBTFUL_TAKEN
  Corners best = corners;
  if (doubt.order) best = corners_of(fetch_triangle(space.best_texel, AS_STORED));
  ivec2 points = with_bits(with_bits(with_bits(NO_BITS, ray.origin), corners), best);
  ivec2 directions = with_bits(NO_BITS, ray.dir);
  bool small = !doubt.range && points.y - points.x <= POINT_BITS && directions.y - directions.x <= DIRECTION_BITS;
  if (small) return decide_in_integers(space, corners, best, prim, best_prim, doubt, points, directions, s);
#endif
  return decide_by_sums(ray, space, corners, texel, prim, best_prim, doubt, s);
}
