// Every numeric mode there is: a line here, made of a triangle test and a box test (shaders/lib/triangle_*.glsl and
// box_*.glsl, included by shaders/lib/numeric/numeric.glsl) and of the leaf format that the triangle test reads.
#pragma once

#include <string_view>

#include "engine/formats/pair.h"
#include "engine/oracle/oracle.h"
#include "shaders/shared/variant.h"

namespace ballot {

struct DeviceInfo;

struct NumericMode {
  std::string_view name;
  int triangle, box;  // BALLOT_TRIANGLE, BALLOT_BOX
  LeafFormat leaves;
  Arithmetic arithmetic;  // whose rounding the judge allows for
  bool conservative;      // answers are equal bit for bit over methods, orders, subgroup and workgroup sizes, and trees
  bool needs_float64;     // shaderFloat64
  std::string_view summary;
};

inline constexpr NumericMode kNumericModes[] = {
    {"fast", TRIANGLE_WOOP_AFFINE, BOX_FMA, LeafFormat::Affine, Arithmetic::WoopAffine, false, false,
     "Woop's affine maps, boxes by multiply-add; least work, least precise far from the origin"},
    {"plain", TRIANGLE_MOELLER, BOX_SLABS, LeafFormat::Vertices, Arithmetic::MoellerTrumbore, false, false,
     "Moeller-Trumbore, boxes as they are; rays can slip between triangles"},
    {"watertight", TRIANGLE_WATERTIGHT, BOX_PADDED, LeafFormat::Vertices, Arithmetic::Woop, true, false,
     "Woop, Benthin and Wald, padded boxes; no ray slips through a closed mesh"},
    {"exact", TRIANGLE_EXACT, BOX_PADDED, LeafFormat::Vertices, Arithmetic::Exact, true, true,
     "every answer is that of arithmetic without rounding: filters, then integers; needs float64"},
};
inline constexpr std::string_view kDefaultNumeric = "watertight";

/// Whose rounding Oracle::judge is to allow for. Its truth is of double precision and may be wrong where float32 cannot
/// tell, so that the answers of mode exact are judged as watertight's; the exact oracle is what holds them to the
/// letter.
constexpr Arithmetic judged_as(const NumericMode& mode) {
  return mode.arithmetic == Arithmetic::Exact ? Arithmetic::Woop : mode.arithmetic;
}

/// Throws Error(Arguments) that lists the modes there are.
const NumericMode& find_numeric(std::string_view name);

/// The same for a device. Throws Error(Arguments) that lists the modes of this device if the device lacks what it
/// needs.
const NumericMode& find_numeric(std::string_view name, const DeviceInfo& device);

}  // namespace ballot
