#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
// Neighbours: an order of points in which those of a subgroup are near each other. The dispatches:
//
//   NEIGHBOURS_SAMPLE  some workgroups put a tile of consecutive points in order, which does for grids and other points
//                      whose neighbours are near already, and sum how far apart neighbours then are
//   NEIGHBOURS_DECIDE  one workgroup: compares that with what an order of all points gives, and has them sorted if it
//                      pays
//   NEIGHBOURS_TILES   if not, each workgroup puts a tile in order
//   NEIGHBOURS_KEYS    if so, a key for each point, by which engine/tree/device/radix_sort.h sorts
//
// A key is the path to a point's cell in a tree that halves the longest side of a box at each level: a Morton code if
// the box is a cube. The order decides no answer.
//
// Control flow is uniform in a workgroup but for single points; shared memory 10 KiB.
#include "../shared/query.h"

layout(local_size_x = NEIGHBOURS_GROUP) in;
layout(push_constant, scalar) uniform Push { NeighboursPush push; };
layout(set = 0, binding = BIND_RAYS, std430) readonly buffer Points { vec4 points[]; };
layout(set = 0, binding = BIND_NEIGHBOUR_STATE, scalar) buffer State { NeighbourState state; };
layout(set = 0, binding = BIND_SORTED, scalar) buffer Sorted { IndirectArgs sorted; };
layout(set = 0, binding = BIND_ORDER_NEAR, std430) writeonly buffer OrderNear { uint order_near[]; };
layout(set = 0, binding = BIND_NEIGHBOUR_KEYS, std430) writeonly buffer Keys { uint keys[]; };

const uint TILE_BITS = 9u, CELLS = 1u << TILE_BITS, SHARE = NEIGHBOURS_TILE / NEIGHBOURS_GROUP;
const float UNIT = 4096.0;  // of NeighbourState::apart, in longest sides of the scene

shared uint counts[CELLS];
shared uint sums[NEIGHBOURS_GROUP];
shared uint placed[NEIGHBOURS_TILE];
shared int lo[3], hi[3];

// Integers of the same order as floats.
int order_of(float x) {
  int i = floatBitsToInt(x);
  return i ^ (i >> 31 & 0x7FFFFFFF);
}
float float_of(int i) { return intBitsToFloat(i ^ (i >> 31 & 0x7FFFFFFF)); }
vec3 floats_of(int x, int y, int z) { return vec3(float_of(x), float_of(y), float_of(z)); }

bool is_finite(vec3 v) { return all(lessThan(uvec3(floatBitsToUint(v) & 0x7FFFFFFFu), uvec3(0x7F800000u))); }

float longest(vec3 v) { return max(v.x, max(v.y, v.z)); }

// How a box is cut into cells: at each level all parts are halved along their longest side.
struct Cells {
  vec3 from, scale;  // scale: cells along a side, by its length
  uvec3 bits;        // levels that halve each side
  uvec2 axes;        // of each level two bits, those of the first ones lowest in x, then in y
};

const uint LEVELS_OF_WORD = 16u;

Cells cells_of(vec3 from, vec3 sides, uint levels) {
  Cells c = Cells(from, vec3(0.0), uvec3(0u), uvec2(0u));
  vec3 part = sides;
  for (uint i = 0u; i < levels; ++i) {
    bool x = part.x >= part.y && part.x >= part.z, y = !x && part.y >= part.z, z = !x && !y;
    part *= vec3(x ? 0.5 : 1.0, y ? 0.5 : 1.0, z ? 0.5 : 1.0);
    c.bits += uvec3(x, y, z);
    uint axis = (z ? 2u : uint(y)) << 2u * (i % LEVELS_OF_WORD);
    if (i < LEVELS_OF_WORD)
      c.axes.x |= axis;
    else
      c.axes.y |= axis;
  }
  c.scale = vec3(uvec3(1u) << c.bits) / max(sides, vec3(1e-30));
  return c;
}

// Returns the path to the cell of a point, or to the last one if it is not finite.
uint path_of(vec3 at, Cells c, uint levels) {
  if (!is_finite(at)) return (1u << levels) - 1u;
  uvec3 cell = uvec3(clamp((at - c.from) * c.scale, vec3(0.0), vec3((uvec3(1u) << c.bits) - 1u)));
  cell <<= 31u - c.bits;  // its highest bit comes next, at bit 30
  uint path = 0u, axes = c.axes.x;
  for (uint i = 0u; i < levels; ++i) {
    uint axis = axes & 3u;
    path = path << 1 | (axis == 0u ? cell.x : axis == 1u ? cell.y : cell.z) >> 30 & 1u;
    cell <<= uvec3(axis == 0u, axis == 1u, axis == 2u);
    axes = i + 1u == LEVELS_OF_WORD ? c.axes.y : axes >> 2;
  }
  return path;
}

// The points of a lane, every NEIGHBOURS_GROUP-th of a tile.
vec3 own[SHARE];

void find_bounds(uint first, uint count) {
  if (gl_LocalInvocationIndex < 3u) {
    lo[gl_LocalInvocationIndex] = 0x7FFFFFFF;
    hi[gl_LocalInvocationIndex] = -0x7FFFFFFF;
  }
  for (uint c = gl_LocalInvocationIndex; c < CELLS; c += NEIGHBOURS_GROUP) counts[c] = 0u;
  barrier();
  vec3 least = vec3(3.4028234e38), most = -least;
  [[unroll]] for (uint k = 0u; k < SHARE; ++k) {
    uint i = k * NEIGHBOURS_GROUP + gl_LocalInvocationIndex;
    own[k] = points[first + min(i, count - 1u)].xyz;
    bool counts_here = is_finite(own[k]);
    least = counts_here ? min(least, own[k]) : least;
    most = counts_here ? max(most, own[k]) : most;
  }
  if (least.x <= most.x)
    for (uint k = 0u; k < 3u; ++k) {
      atomicMin(lo[k], order_of(least[k]));
      atomicMax(hi[k], order_of(most[k]));
    }
  barrier();
}

// Turns numbers of points in cells into the places of their first ones.
void sum_counts() {
  const uint share = CELLS / NEIGHBOURS_GROUP;
  uint lane = gl_LocalInvocationIndex, sum = 0u;
  for (uint c = 0u; c < share; ++c) sum += counts[lane * share + c];
  sums[lane] = sum;
  for (uint step = 1u; step < NEIGHBOURS_GROUP; step <<= 1) {
    barrier();
    uint before = lane >= step ? sums[lane - step] : 0u;
    barrier();
    sums[lane] += before;
  }
  barrier();
  uint place = sums[lane] - sum;
  for (uint c = 0u; c < share; ++c) {
    uint in_cell = counts[lane * share + c];
    counts[lane * share + c] = place;
    place += in_cell;
  }
  barrier();
}

// Returns the longest side of the box of a share of the tile's points, in their order.
float apart(uint first, uint begin, uint end) {
  vec3 least = vec3(3.4028234e38), most = -least;
  for (uint i = begin; i < end; ++i) {
    vec3 at = points[first + placed[i]].xyz;
    if (!is_finite(at)) continue;
    least = min(least, at);
    most = max(most, at);
  }
  return max(longest(most - least), 0.0);
}

void order_tile(uint begin) {
  uint first = push.first + begin, count = min(push.count - begin, NEIGHBOURS_TILE), lane = gl_LocalInvocationIndex;
  find_bounds(first, count);
  vec3 from = floats_of(lo[0], lo[1], lo[2]);
  Cells tile = cells_of(from, floats_of(hi[0], hi[1], hi[2]) - from, TILE_BITS);
  uint cells[SHARE];
  [[unroll]] for (uint k = 0u; k < SHARE; ++k) {
    cells[k] = path_of(own[k], tile, TILE_BITS);
    if (k * NEIGHBOURS_GROUP + lane < count) atomicAdd(counts[cells[k]], 1u);
  }
  barrier();
  sum_counts();
  [[unroll]] for (uint k = 0u; k < SHARE; ++k) {
    uint i = k * NEIGHBOURS_GROUP + lane;
    if (i < count) placed[atomicAdd(counts[cells[k]], 1u)] = i;
  }
  barrier();
}

void make_tile() {
  if (sorted.count > 0u) return;
  uint begin = gl_WorkGroupID.x * NEIGHBOURS_TILE;
  order_tile(begin);
  for (uint i = gl_LocalInvocationIndex; i < min(push.count - begin, NEIGHBOURS_TILE); i += NEIGHBOURS_GROUP)
    order_near[begin + i] = push.first + begin + placed[i];
}

// Whole tiles are sampled.
void sample_tile() {
  uint tiles = push.count / NEIGHBOURS_TILE, lane = gl_LocalInvocationIndex;
  uint begin = uint(float(gl_WorkGroupID.x) / float(gl_NumWorkGroups.x) * float(tiles)) * NEIGHBOURS_TILE;
  order_tile(begin);
  float part = min(apart(push.first + begin, lane * SHARE, lane * SHARE + SHARE) / push.side, 1.0);
  sums[lane] = uint(part * UNIT);
  for (uint step = NEIGHBOURS_GROUP / 2u; step > 0u; step >>= 1) {
    barrier();
    if (lane < step) sums[lane] += sums[lane + step];
  }
  if (lane < 3u && lo[lane] <= hi[lane]) {
    atomicMin(state.lo[lane], lo[lane]);
    atomicMax(state.hi[lane], hi[lane]);
  }
  if (lane == 0u) atomicAdd(state.apart, sums[0]);
}

// Returns the longest side of the cells if each holds a share of points that fill a box evenly.
float apart_when_sorted(vec3 sides) {
  float a = longest(sides), c = min(sides.x, min(sides.y, sides.z)), b = sides.x + sides.y + sides.z - a - c;
  float shares = float(push.count) / float(SHARE);
  float cube = pow(a * b * c / shares, 1.0 / 3.0), square = sqrt(a * b / shares);
  return c >= cube ? cube : b >= square ? square : a / shares;
}

void decide() {
  if (gl_LocalInvocationIndex > 0u) return;
  vec3 sides = floats_of(state.hi[0], state.hi[1], state.hi[2]) - floats_of(state.lo[0], state.lo[1], state.lo[2]);
  float mean = float(state.apart) / UNIT * push.side / float(push.samples * NEIGHBOURS_GROUP);
  bool pays = mean > NEIGHBOURS_PAYS * apart_when_sorted(sides);
  sorted.count = pays ? push.count : 0u;
}

shared Cells all_cells;

void make_key() {
  if (sorted.count == 0u) return;
  if (gl_LocalInvocationIndex == 0u) {
    vec3 from = floats_of(state.lo[0], state.lo[1], state.lo[2]);
    all_cells = cells_of(from, floats_of(state.hi[0], state.hi[1], state.hi[2]) - from, NEIGHBOURS_KEY_BITS);
  }
  barrier();
  uint begin = gl_WorkGroupID.x * NEIGHBOURS_TILE, end = min(begin + NEIGHBOURS_TILE, push.count);
  for (uint i = begin + gl_LocalInvocationIndex; i < end; i += NEIGHBOURS_GROUP)
    keys[i] = path_of(points[push.first + i].xyz, all_cells, NEIGHBOURS_KEY_BITS);
}

void main() {
  if (push.step == NEIGHBOURS_TILES)
    make_tile();
  else if (push.step == NEIGHBOURS_SAMPLE)
    sample_tile();
  else if (push.step == NEIGHBOURS_DECIDE)
    decide();
  else
    make_key();
}
