// Morton codes as keys of a sort: one word, or two with the lower one first (BALLOT_KEY_WORDS).
#if BALLOT_KEY_WORDS == 2
#define Key uvec2
uint digit_of(Key key, uint shift) { return (shift < 32u ? key.x >> shift : key.y >> (shift - 32u)) & 0xFFu; }
Key code_with_bit(Key code, uint bit) { return uvec2(code.x << 1 | bit, code.y << 1 | code.x >> 31); }
const Key NO_CODE = uvec2(0xFFFFFFFFu);
// The last code of 40 to 64 bits.
Key last_code(uint bits) { return uvec2(0xFFFFFFFFu, 0xFFFFFFFFu >> (64u - bits)); }
Key code_before(Key code) { return uvec2(code.x ^ 1u, code.y); }  // of an odd code
// The bits in which two keys differ, in order of their weight: (upper word, lower word).
uvec2 difference(Key a, Key b) { return (a ^ b).yx; }
#else
#define Key uint
uint digit_of(Key key, uint shift) { return key >> shift & 0xFFu; }
Key code_with_bit(Key code, uint bit) { return code << 1 | bit; }
const Key NO_CODE = 0xFFFFFFFFu;
Key last_code(uint bits) { return 0xFFFFFFFFu >> (32u - bits); }
Key code_before(Key code) { return code ^ 1u; }
uvec2 difference(Key a, Key b) { return uvec2(0u, a ^ b); }
#endif
