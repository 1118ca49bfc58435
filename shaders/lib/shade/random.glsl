// Counter-based random numbers: the same for a pixel, sample and dimension on every device and for every method.
//
// Source: the integer hash "lowbias32", Chris Wellons, Prospecting for Hash Functions, 2018 (nullprogram.com).

uint hash_word(uint x) {
  x ^= x >> 16;
  x *= 0x7FEB352Du;
  x ^= x >> 15;
  x *= 0x846CA68Bu;
  return x ^ x >> 16;
}

// Returns a random number in [0, 1) with 24 bits.
float random_number(uint pixel, uint sample_index, uint dimension) {
  return float(hash_word(pixel + hash_word(sample_index + hash_word(dimension + 0x9E3779B9u))) >> 8) *
         (1.0 / 16777216.0);
}

// Owen-scrambled Sobol' points. The first 2^k samples of a pixel put one into each of 2^k equal boxes, whatever the
// shape of these, so sums converge faster than those of independent numbers. Each dimension of a pixel is scrambled by
// itself, and pairs are shuffled, so that dimensions do not depend on each other.
//
// Source: Brent Burley, Practical Hash-based Owen Scrambling, Journal of Computer Graphics Techniques 9 (4), 2020, with
// the permutation of Laine and Karras, Stratified Sampling for Stochastic Transparency, EGSR 2011.

// Permutes the bits of a number, lowest first: each depends on those below it.
uint scrambled_bits(uint x, uint seed) {
  x += seed;
  x ^= x * 0x6C50B47Cu;
  x ^= x * 0xB82F1E52u;
  x ^= x * 0xC7AFE638u;
  return x ^ x * 0x8D22F6E6u;
}

// Multiplies by Pascal's triangle modulo 2, the generator matrix of the second dimension; one step for each factor of
// its Kronecker product.
uint pascal_bits(uint x) {
  x ^= x >> 1 & 0x55555555u;
  x ^= x >> 2 & 0x33333333u;
  x ^= x >> 4 & 0x0F0F0F0Fu;
  x ^= x >> 8 & 0x00FF00FFu;
  return x ^ x >> 16 & 0x0000FFFFu;
}

// Returns the number in [0, 1), of 24 bits, whose bits are these, the first behind the point the lowest.
float fraction_of(uint bits) { return float(bitfieldReverse(bits) >> 8) * (1.0 / 16777216.0); }

// Returns sample `sample_index` of a pixel in two dimensions, which begin at `dimension`.
vec2 sample_pair(uint pixel, uint sample_index, uint dimension) {
  uint seed = hash_word(pixel + hash_word(dimension + 0x9E3779B9u));
  uint i = bitfieldReverse(scrambled_bits(bitfieldReverse(sample_index), seed));
  return vec2(fraction_of(scrambled_bits(i, hash_word(seed + 1u))),
              fraction_of(scrambled_bits(pascal_bits(i), hash_word(seed + 2u))));
}

// The same in one dimension.
float sample_one(uint pixel, uint sample_index, uint dimension) {
  uint seed = hash_word(pixel + hash_word(dimension + 0x9E3779B9u));
  uint i = bitfieldReverse(scrambled_bits(bitfieldReverse(sample_index), seed));
  return fraction_of(scrambled_bits(i, hash_word(seed + 1u)));
}
