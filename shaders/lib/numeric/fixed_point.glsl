// Sums of products of three float32 numbers, and the sign of a difference of products of two such sums, without
// rounding.
//
// A finite float32 is m * 2^e with an integer |m| < 2^24 and e from -149 to 104. A sum is a fixed-point number: digits
// of 16 bits, the least significant first, in units of 2^(3 base), where base is the least e of all numbers in use.
// Digits are signed integers, so a product is added without carries. One pass at the end makes each digit 0 to 65535,
// except for a sign digit, 0 or -1, on top.
//
// Source: Ulrich Kulisch. Computer Arithmetic and Validity. De Gruyter, 2008, chapter 8 (the long accumulator).
//
// Size: a product has 72 bits and lies less than 3 (104 + 149) = 759 bits above the unit. A sum of at most 24 products
// needs 5 more bits, and its sign digit 1 more word: 53 digits and the sign.

const uint SUM_DIGITS = 54u;
int sum_digits[4u * SUM_DIGITS];  // four sums; each begins at a multiple of SUM_DIGITS
uint sum_numbers[24];             // bits of the numbers in use: eight vectors
int sum_base;
uint sum_length;                  // digits of every sum, without the sign digit

uint mantissa_of(uint bits) { return (bits & 0x7FFFFFu) | ((bits & 0x7F800000u) != 0u ? 0x800000u : 0u); }
int exponent_of(uint bits) { return max(int(bits >> 23 & 0xFFu), 1) - 150; }

// Sets base and length for the first `count` numbers, of which at least one must not be zero.
void size_sums(uint count) {
  int least = 104, most = -149;
  for (uint i = 0u; i < count; ++i) {
    uint bits = sum_numbers[i];
    int e = exponent_of(bits);
    bool zero = mantissa_of(bits) == 0u;
    least = zero ? least : min(least, e);
    most = zero ? most : max(most, e);
  }
  sum_base = least;
  sum_length = uint(3 * (most - least) + 78 + 15) / 16u;
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

// Propagates the carries of the sum. Returns it in its unit, to a relative error of 2^-47. The result is zero only if
// the sum is zero, and has the sum's sign.
double finish_sum(uint at) {
  int carry = 0;
  for (uint i = 0u; i < sum_length; ++i) {
    int digit = sum_digits[at + i] + carry;
    sum_digits[at + i] = digit & 0xFFFF;
    carry = digit >> 16;
  }
  sum_digits[at + sum_length] = carry;
  // A number that fits into 53 bits is exact on the way down, including the sign digit and those after it.
  precise double value = double(carry);
  for (uint i = sum_length; i > 0u; --i) value = value * 65536.0lf + double(sum_digits[at + i - 1u]);
  return value;
}

// Sets sums 2 and 3 to a fraction that equals a float32. Returns the number of their digits.
uint set_fraction(uint bits) {
  int e = exponent_of(bits);
  uint up = uint(max(e, 0)), down = uint(max(-e, 0)), m = mantissa_of(bits), shift = up & 15u;
  uint count = max(up >> 4, down >> 4) + 3u;
  for (uint i = 0u; i < count; ++i) {
    sum_digits[2u * SUM_DIGITS + i] = 0;
    sum_digits[3u * SUM_DIGITS + i] = 0;
  }
  int sign = bits >> 31 != 0u ? -1 : 1;
  uint low = m << shift, high = (m >> 1) >> (31u - shift), at = 2u * SUM_DIGITS + (up >> 4);
  sum_digits[at] = sign * int(low & 0xFFFFu);
  sum_digits[at + 1u] = sign * int(low >> 16);
  sum_digits[at + 2u] = sign * int(high);
  sum_digits[3u * SUM_DIGITS + (down >> 4)] = 1 << (down & 15u);
  return count;
}

// Returns the sign of sum 0 * sum 3 - sum 1 * sum 2, where 2 and 3 have `count` digits. A column is a sum of at most
// 108 products below 2^32 and a carry: exact in double.
int compare_fractions(uint count) {
  uint length = sum_length + 1u;
  double carry = 0.0lf;
  bool rest = false;
  for (uint k = 0u; k + 1u < length + count; ++k) {
    double column = carry;
    for (uint i = k < count ? 0u : k + 1u - count; i <= min(k, length - 1u); ++i)
      column += double(sum_digits[i]) * double(sum_digits[3u * SUM_DIGITS + k - i]) -
                double(sum_digits[SUM_DIGITS + i]) * double(sum_digits[2u * SUM_DIGITS + k - i]);
    carry = floor(column * (1.0lf / 65536.0lf));
    rest = rest || column != carry * 65536.0lf;
  }
  return carry < 0.0lf ? -1 : carry > 0.0lf || rest ? 1 : 0;
}
