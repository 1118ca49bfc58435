// The grid of a node whose boxes take a byte a plane, in C++ and GLSL. Along an axis it has the positions
// first + q * step with q from 0 to GRID_STEPS. A step has 16 significant bits, so q * step is exact in float32, and so
// is rounding to the grid: the host and every device write the same bytes. A device that takes denormal numbers for
// zero may differ for coordinates below 2^-100. It takes them for zero when it traces, too.
#ifndef BALLOT_GRID_H
#define BALLOT_GRID_H

#include "layout.h"

#ifdef __cplusplus
#include <bit>
#define GRID_FUNCTION inline
#define GRID_PRECISE  // compiled without contraction
#define GRID_BITS(x) std::bit_cast<ballot::uint>(x)
#define GRID_FLOAT(bits) std::bit_cast<float>(bits)
namespace ballot {
#else
#define GRID_FUNCTION
#define GRID_PRECISE precise
#define GRID_BITS(x) floatBitsToUint(x)
#define GRID_FLOAT(bits) uintBitsToFloat(bits)
#endif

#define GRID_STEPS 255u
// 2^-120, the smallest step. Its products with directions are not denormal, so no device flushes them to zero.
#define GRID_SMALLEST_STEP 7.52316385e-37f
// 2^-20, the share of a node's extent by which bvh8 widens its children (engine/tree/formats/bvh8.h).
#define GRID_MARGIN 9.5367431640625e-7f

// The difference x - y, kept exactly as rounded + rest.
//
// Source: Ole Moeller. Quasi double-precision in floating point addition. BIT 5, 1965.
struct Difference {
  float rounded;
  float rest;
};

GRID_FUNCTION Difference difference(float x, float y) {
  GRID_PRECISE float rounded = x - y;
  GRID_PRECISE float part = rounded - x;
  GRID_PRECISE float rest = (x - (rounded - part)) - (y + part);
  Difference d;
  d.rounded = rounded;
  d.rest = rest;
  return d;
}

GRID_FUNCTION bool is_at_least(Difference d, float x) { return d.rounded > x || (d.rounded == x && d.rest >= 0.0f); }
GRID_FUNCTION bool is_at_most(Difference d, float x) { return d.rounded < x || (d.rounded == x && d.rest <= 0.0f); }

// The next floats above and below. Beside zero they are +-1e-37, as devices may take smaller ones for zero.
GRID_FUNCTION float float_above(float x) {
  uint bits = GRID_BITS(x);
  return x == 0.0f ? 1e-37f : GRID_FLOAT(bits >= 0x80000000u ? bits - 1u : bits + 1u);
}
GRID_FUNCTION float float_below(float x) { return -float_above(-x); }

// Returns the smallest step of a grid from lo on that reaches hi.
GRID_FUNCTION float grid_step(float lo, float hi) {
  Difference extent = difference(hi, lo);
  float least = extent.rounded / float(GRID_STEPS);
  uint bits = GRID_BITS(least < GRID_SMALLEST_STEP ? GRID_SMALLEST_STEP : least) & 0xFFFFFF00u;
  // The quotient is rounded, and then cut off: two more of its last place always suffice.
  for (uint i = 0u; i < 2u; ++i)
    if (!is_at_most(extent, float(GRID_STEPS) * GRID_FLOAT(bits))) bits += 0x100u;
  return GRID_FLOAT(bits);
}

// Returns the largest q whose position is not above x, which lies between first and the last position.
GRID_FUNCTION uint grid_below(float first, float step, float x) {
  Difference d = difference(x, first);
  uint q = uint(d.rounded / step);  // off by one at most
  if (q > GRID_STEPS) q = GRID_STEPS;
  if (q < GRID_STEPS && is_at_least(d, float(q + 1u) * step)) return q + 1u;
  return is_at_least(d, float(q) * step) ? q : q - 1u;
}

// Returns the smallest q whose position is not below x.
GRID_FUNCTION uint grid_above(float first, float step, float x) {
  uint q = grid_below(first, step, x);
  return is_at_most(difference(x, first), float(q) * step) ? q : q + 1u;
}

// Return the bounds of a child widened by GRID_MARGIN of its node's extent, rounded outward. The extent is a difference
// of floats, and the sum of three terms is exact until it is rounded. Of a tiny extent the margin may be denormal and
// rounded itself: one float more covers that.
GRID_FUNCTION bool is_tiny(Difference extent) { return extent.rounded > 0.0f && extent.rounded < 1e-24f; }
GRID_FUNCTION float widened_below(float lo, Difference extent) {
  Difference d = difference(lo, GRID_MARGIN * extent.rounded);
  return d.rest < GRID_MARGIN * extent.rest || is_tiny(extent) ? float_below(d.rounded) : d.rounded;
}
GRID_FUNCTION float widened_above(float hi, Difference extent) {
  Difference d = difference(hi, -GRID_MARGIN * extent.rounded);
  return d.rest > -GRID_MARGIN * extent.rest || is_tiny(extent) ? float_above(d.rounded) : d.rounded;
}

#ifdef __cplusplus
static_assert(GRID_SMALLEST_STEP == 0x1p-120f && GRID_MARGIN == 0x1p-20f);
}  // namespace ballot
#endif

#undef GRID_FUNCTION
#undef GRID_PRECISE
#undef GRID_BITS
#undef GRID_FLOAT
#endif  // BALLOT_GRID_H
