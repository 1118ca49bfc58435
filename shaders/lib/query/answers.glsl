// The answers that columns are of, as words, since devices may flush denormal floats. BALLOT_POINTS: 1: nearest points
// of points (Nearest), 0: hits of rays (Hit).
#define OUT(column) layout(set = 0, binding = BIND_COLUMNS + column, scalar)

struct Record {
  uint prim, distance;
  uvec2 uv;
};
layout(set = 0, binding = BIND_HITS, scalar) readonly buffer Found { uvec4 found[]; };  // of points two a record
#if BALLOT_POINTS
Record record_of(uint i) { return Record(found[2u * i + 1u].x, found[2u * i].w, found[2u * i + 1u].yz); }
#else
Record record_of(uint i) { return Record(found[i].y, found[i].y != NO_HIT ? found[i].x : 0x7F800000u, found[i].zw); }
#endif

// Defines NAME(begin, count, number): the last of `count` rising numbers of `table` from `begin` on that is not above
// `number`. The first is not.
#define SEARCH(NAME, table)                         \
  uint NAME(uint begin, uint count, uint number) {  \
    uint low = 0u, high = count;                    \
    while (high - low > 1u) {                       \
      uint middle = (low + high) / 2u;              \
      if (table[begin + middle] <= number)          \
        low = middle;                               \
      else                                          \
        high = middle;                              \
    }                                               \
    return low;                                     \
  }
