// The registry of numeric modes. A mode is a row here. It names a triangle test and a box test (triangle_*.glsl and
// box_*.glsl in shaders/lib/numeric/, which numeric.glsl includes), and the leaf format that the triangle test reads.
#pragma once

#include <string_view>

#include "engine/formats/pair.h"
#include "engine/oracle/oracle.h"
#include "shaders/shared/variant.h"

namespace ballot {

struct DeviceInfo;

/// A numeric mode: the arithmetic by which rays are tested against triangles and boxes.
struct NumericMode {
  std::string_view name;
  int triangle, box;  // BALLOT_TRIANGLE, BALLOT_BOX
  LeafFormat leaves;
  Arithmetic arithmetic;  // the triangle test's; Oracle::judge allows for its rounding error
  bool conservative;      // answers are equal bit for bit over methods, orders, subgroup and workgroup sizes, and trees
  bool needs_float64;     // shaderFloat64
  std::string_view summary;
};

inline constexpr NumericMode kNumericModes[] = {
    {"fast", TRIANGLE_WOOP_AFFINE, BOX_FMA, LeafFormat::Affine, Arithmetic::WoopAffine, false, false,
     "Woop's affine maps, boxes by multiply-add; least work, least precise far from the origin"},
    {"plain", TRIANGLE_MOELLER, BOX_SLABS, LeafFormat::Vertices, Arithmetic::MoellerTrumbore, false, false,
     "Moeller-Trumbore, boxes without padding; rays can slip between triangles"},
    {"watertight", TRIANGLE_WATERTIGHT, BOX_PADDED, LeafFormat::Vertices, Arithmetic::Woop, true, false,
     "Woop, Benthin and Wald, with padded boxes; no ray slips through a closed mesh"},
    {"exact", TRIANGLE_EXACT, BOX_PADDED, LeafFormat::Vertices, Arithmetic::Exact, true, true,
     "every answer is that of arithmetic without rounding: filters, then integers; needs float64"},
};
inline constexpr std::string_view kDefaultNumeric = "watertight";

/// Returns the arithmetic whose rounding error Oracle::judge is to allow for. The truth of that oracle has double
/// precision and may be wrong where float32 cannot tell. So it judges the hits of mode exact as those of watertight;
/// the exact oracle alone can check them to the letter.
constexpr Arithmetic judged_as(const NumericMode& mode) {
  return mode.arithmetic == Arithmetic::Exact ? Arithmetic::Woop : mode.arithmetic;
}

/// Returns the mode of this name. Throws Error(Arguments), which lists the modes, if there is none.
const NumericMode& find_numeric(std::string_view name);

/// The same for a device. Also throws Error(Arguments), which lists the modes that the device can run, if the device
/// lacks what the mode needs.
const NumericMode& find_numeric(std::string_view name, const DeviceInfo& device);

}  // namespace ballot
