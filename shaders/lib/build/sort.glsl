// A least significant digit radix sort in three kernels for each digit: sort_count.comp counts the keys of each digit
// in each tile, sort_sum.comp sums the counts up over the tiles, and sort_move.comp moves keys and prims. A dispatch
// waits for the one before it, so no workgroup waits for another one.
//
// Nadathur Satish, Mark Harris, Michael Garland. Designing Efficient Sorting Algorithms for Manycore GPUs. IPDPS 2009
// (counts, sums, moves); Andrew Adinets, Duane Merrill. Onesweep. 2022 (a lane finds the lanes with its digit by a
// ballot for each bit). Differs: keys go from registers to their places without a stop in shared memory.
#include "frame.glsl"
#include "keys.glsl"

layout(push_constant, scalar) uniform Push { SortPush push; };
layout(set = 0, binding = BIND_BUILD_COUNTS, std430) buffer Counts { uint counts[]; };

#if BALLOT_INDIRECT
layout(set = 0, binding = BIND_BUILD_ARGS, scalar) readonly buffer Args { IndirectArgs args[]; };
uint key_count() { return min(push.keys, args[push.args].count); }
#else
uint key_count() { return push.keys; }
#endif

const uint TILE = GROUP_SIZE * BUILD_TILE_KEYS;
