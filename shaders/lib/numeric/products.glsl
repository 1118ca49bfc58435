// Products and their sums, computed by the method that BALLOT_PRODUCTS names (shared/knobs.h).

// Returns a * b - c * d with the exact sign and a relative error of at most 2^-23, whatever cancels: the result is zero
// only if the products are equal. This holds below overflow and while no product of the parts underflows, that is for
// products above 2^-102; below, small differences may be lost.

float difference_of_products(float a, float b, float c, float d) {
#if BALLOT_PRODUCTS == PRODUCTS_FMA
  // William Kahan's algorithm: Claude-Pierre Jeannerod, Nicolas Louvet, Jean-Michel Muller. Further Analysis of Kahan's
  // Algorithm for the Accurate Computation of 2x2 Determinants. Mathematics of Computation 82, 2013. It needs an fma()
  // that rounds once, which Vulkan does not guarantee; engine/answer/tuning.cpp lists the devices that have it.
  precise float cd = c * d;
  precise float error = fma(-c, d, cd);
  precise float difference = fma(a, b, -cd);
  precise float sum = difference + error;
  return sum;
#elif BALLOT_PRODUCTS == PRODUCTS_FLOAT64
  // The products of floats are exact in double.
  precise double difference = double(a) * double(b) - double(c) * double(d);
  return float(difference);
#else
  // Each product as a sum of two floats: T. J. Dekker. A Floating-Point Technique for Extending the Available
  // Precision.
  // Numerische Mathematik 18, 1971.
  precise float split_a = a * 4097.0, split_b = b * 4097.0, split_c = c * 4097.0, split_d = d * 4097.0;
  precise float a1 = split_a - (split_a - a), b1 = split_b - (split_b - b), c1 = split_c - (split_c - c),
                d1 = split_d - (split_d - d);
  precise float a0 = a - a1, b0 = b - b1, c0 = c - c1, d0 = d - d1;
  precise float ab = a * b, cd = c * d;
  precise float ab_low = ((a1 * b1 - ab) + a1 * b0 + a0 * b1) + a0 * b0;
  precise float cd_low = ((c1 * d1 - cd) + c1 * d0 + c0 * d1) + c0 * d0;
  precise float high = ab - cd;
  precise float low = ab_low - cd_low;
  // The rounding errors of both. Where high and low cancel, their sum is exact, and so is the sign of the last sum.
  precise float back = high - ab, low_back = low - ab_low;
  precise float lost = (ab - (high - back)) - (cd + back);
  precise float low_lost = (ab_low - (low - low_back)) - (cd_low + low_back);
  precise float sum = (high + (lost + low)) + low_lost;
  return sum;
#endif
}

// Returns a * b + c. The product is not rounded where that is cheap.
#if BALLOT_PRODUCTS == PRODUCTS_FMA
#define PRODUCT_PLUS(a, b, c) fma(a, b, c)
#else
#define PRODUCT_PLUS(a, b, c) ((a) * (b) + (c))
#endif
float multiply_add(float a, float b, float c) {
  precise float sum = PRODUCT_PLUS(a, b, c);
  return sum;
}
vec3 multiply_add(vec3 a, vec3 b, vec3 c) {
  precise vec3 sum = PRODUCT_PLUS(a, b, c);
  return sum;
}
