// Sums of products of three float32 numbers, and the sign of a difference of products of two such sums, without
// rounding.
//
// A finite float32 is m * 2^e with an integer |m| < 2^24 and e from -149 to 104. A sum is a fixed-point number: digits
// of 16 bits, the least significant first, in units of 2^(3 base), where base is not above the e of any number in use.
// Digits are signed integers, so a product is added without carries. At the end a sum becomes its sign and its
// magnitude, in words of 32 bits, the least significant first.
//
// Source: Ulrich Kulisch. Computer Arithmetic and Validity. De Gruyter, 2008, chapter 8 (the long accumulator).
//
// Size: a product has 72 bits and lies less than 3 (104 + 149) = 759 bits above the unit. A sum of at most 24 products
// needs 5 more bits, and its sign digit 1 more word: 53 digits and the sign.

const uint SUM_DIGITS = 54u, FRACTION_WORDS = 6u;
// Four sums, each at a multiple of SUM_DIGITS, the two numbers of a fraction, and notes: what lasts from one use of the
// sums to the next. In registers it would slow the walk down (tools/measured/scaling.md).
const uint FRACTION_AT = 4u * SUM_DIGITS, NOTES_AT = FRACTION_AT + 2u * FRACTION_WORDS;
const uint NOTE_BASE = NOTES_AT, NOTE_TOP = NOTES_AT + 1u;  // the least and the largest e that sums are made for
const uint NOTE_TEXEL = NOTES_AT + 2u, NOTE_SIGN = NOTES_AT + 3u;  // for exact_decision.glsl
const uint NOTE_DECISIONS = NOTES_AT + 4u;
int sum_digits[NOTES_AT + 5u];
uint sum_numbers[24];        // bits of the numbers in use: eight vectors
int sum_base;
uint sum_length, sum_words;  // digits of every sum, without the sign digit; words of its magnitude

// Sets the size of sums for the first `count` numbers, of which at least one must not be zero. With `keep` the size
// serves the numbers before, too. Returns true if it is the size before, so that finished sums may be kept.
bool size_sums(uint count, bool keep) {
  int least = 104, most = -149;
  for (uint i = 0u; i < count; ++i) {
    uint bits = sum_numbers[i];
    int e = exponent_of(bits);
    bool zero = mantissa_of(bits) == 0u;
    least = zero ? least : min(least, e);
    most = zero ? most : max(most, e);
  }
  int base = sum_digits[NOTE_BASE], top = sum_digits[NOTE_TOP];
  bool same = keep && least >= base && most <= top;
  base = keep ? min(base, least) : least;
  top = keep ? max(top, most) : most;
  sum_digits[NOTE_BASE] = sum_base = base;
  sum_digits[NOTE_TOP] = top;
  sum_length = uint(3 * (top - base) + 78 + 15) / 16u;
  sum_words = (sum_length + 1u) / 2u;
  return same;
}

// Adds x * y * z, or its opposite, to the sum that begins at `at`.
void add_product(uint at, uint x, uint y, uint z, bool opposite) {
  uint high, low, w0, w1, w2, more, carry;
  umulExtended(mantissa_of(x), mantissa_of(y), high, low);
  umulExtended(low, mantissa_of(z), more, w0);
  umulExtended(high, mantissa_of(z), w2, w1);
  w1 = uaddCarry(w1, more, carry);
  w2 += carry;
  uint position = (w0 | w1 | w2) == 0u ? 0u : uint(exponent_of(x) + exponent_of(y) + exponent_of(z) - 3 * sum_base);
  uint shift = position & 15u, back = 31u - shift;
  uint words[3] = uint[3](w0 << shift, w1 << shift | (w0 >> 1) >> back, w2 << shift | (w1 >> 1) >> back);
  int sign = ((x ^ y ^ z) >> 31 != 0u) != opposite ? -1 : 1;
  at += position >> 4;
  for (uint i = 0u; i < 3u; ++i) {
    sum_digits[at + 2u * i] += sign * int(words[i] & 0xFFFFu);
    sum_digits[at + 2u * i + 1u] += sign * int(words[i] >> 16);
  }
}

void clear_digits(uint at, uint count) {
  for (uint i = 0u; i < count; ++i) sum_digits[at + i] = 0;
}

// Returns the 53 leading bits of a number, given its highest word that is not zero and the two below, and its place.
double leading_bits(uvec3 top, int place) {
  if (top.x == 0u) return 0.0lf;
  int shift = 31 - findMSB(top.x);
  uvec2 bits = top.xy << shift | (top.yz >> 1) >> (31 - shift);
  double leading = double(bits.x) * 4294967296.0lf + double(bits.y & 0xFFFFF800u);
  return leading * packDouble2x32(uvec2(0u, uint(1023 + 32 * (place - 1) - shift) << 20));
}

// Finishes a sum: its digits become the words of its magnitude. Returns its 53 leading bits times the unit, so that a
// quotient of two sums does not depend on the unit.
double finish_sum(uint at) {
  int carry = 0;
  for (uint i = 0u; i < sum_length; ++i) {
    int digit = sum_digits[at + i] + carry;
    sum_digits[at + i] = digit & 0xFFFF;
    carry = digit >> 16;
  }
  sum_digits[at + sum_length] = carry;
  bool negative = carry < 0;
  uint flip = negative ? 0xFFFFFFFFu : 0u, more = negative ? 1u : 0u, below = 0u, below_that = 0u;
  uvec3 top = uvec3(0u);  // the highest word that is not zero, and the two below it
  int place = 0;
  for (uint i = 0u; i < sum_words; ++i) {
    uint word = ((uint(sum_digits[at + 2u * i]) | uint(sum_digits[at + 2u * i + 1u]) << 16) ^ flip) + more;
    more = word == 0u ? more : 0u;
    sum_digits[at + i] = int(word);
    if (word != 0u) {
      top = uvec3(word, below, below_that);
      place = int(i);
    }
    below_that = below;
    below = word;
  }
  double size = leading_bits(top, place);
  return negative ? -size : size;
}

// Sets the fraction to the magnitude of a float32. Returns the number of words of its two numbers.
uint set_fraction(uint bits) {
  int e = exponent_of(bits);
  uint up = uint(max(e, 0)), down = uint(max(-e, 0)), m = mantissa_of(bits), shift = up & 31u;
  for (uint i = 0u; i < 2u * FRACTION_WORDS; ++i) sum_digits[FRACTION_AT + i] = 0;
  uint at = FRACTION_AT + (up >> 5);
  sum_digits[at] = int(m << shift);
  sum_digits[at + 1u] = int((m >> 1) >> (31u - shift));
  sum_digits[FRACTION_AT + FRACTION_WORDS + (down >> 5)] = int(1u << (down & 31u));
  return max(up >> 5, down >> 5) + 2u;
}

// Adds x * y to a number of 96 bits.
void add_wide(inout uvec3 sum, uint x, uint y) {
  uint high, low, carry, more;
  umulExtended(x, y, high, low);
  sum.x = uaddCarry(sum.x, low, carry);
  sum.y = uaddCarry(sum.y, high + carry, more);
  sum.z += more;
}

// Returns the sign of a * d - b * c, with the magnitudes a of sum 0 and b of sum 1, and numbers of `count` words that
// begin at c and d. A column is a sum of at most 54 products below 2^64, and what is carried.
int compare_fractions(uint c, uint d, uint count) {
  uvec3 column = uvec3(0u);  // two's complement
  bool rest = false;
  for (uint k = 0u; k + 1u < sum_words + count; ++k) {
    for (uint i = k < count ? 0u : k + 1u - count; i <= min(k, sum_words - 1u); ++i) {
      add_wide(column, uint(sum_digits[i]), uint(sum_digits[d + k - i]));
      column = ~column;  // ~(~x + y) is x - y
      add_wide(column, uint(sum_digits[SUM_DIGITS + i]), uint(sum_digits[c + k - i]));
      column = ~column;
    }
    rest = rest || column.x != 0u;
    column = uvec3(column.yz, uint(int(column.z) >> 31));
  }
  return int(column.z) < 0 ? -1 : rest || (column.x | column.y | column.z) != 0u ? 1 : 0;
}
