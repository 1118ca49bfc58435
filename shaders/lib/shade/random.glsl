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
