// The registry of numeric modes. A mode is a row here: a triangle test and a box test
// (shaders/lib/numeric/triangle_*.glsl and box_*.glsl, included by numeric.glsl there) and the leaf format that the
// triangle test reads.
#pragma once

#include <string_view>

#include "engine/core/want.h"
#include "engine/tree/formats/pair.h"
#include "shaders/shared/variant.h"

namespace ballot {

struct DeviceInfo;

/// Who answers rays in scenes with shapes other than triangles: nobody, kernels, or the host (engine/oracle/exact.h).
enum class TakesShapes { No, Kernels, Host };

struct NumericMode {
  std::string_view name;
  std::string_view summary;
  int triangle, box;  // BALLOT_TRIANGLE, BALLOT_BOX
  LeafFormat leaves = LeafFormat::Vertices;
  Arithmetic arithmetic;      // the arithmetic whose rounding error the judge allows
  bool conservative = false;  // answers are equal bit for bit over methods, orders, subgroup and workgroup sizes, trees
  bool needs_float64 = false;  // shaderFloat64
  TakesShapes shapes = TakesShapes::No;
  bool leaves_open = false;  // kernels may list rays in doubt (Doubtful, kernel_config.h)
};

// clang-format off
inline constexpr NumericMode kNumericModes[] = {
    {.name = "fast",
     .summary = "Woop's affine maps, boxes by multiply-add; least work, least precise far from the origin",
     .triangle = TRIANGLE_WOOP_AFFINE, .box = BOX_FMA, .leaves = LeafFormat::Affine,
     .arithmetic = Arithmetic::WoopAffine},
    {.name = "plain", .summary = "Moeller-Trumbore, boxes without padding; rays can slip between triangles",
     .triangle = TRIANGLE_MOELLER, .box = BOX_SLABS, .arithmetic = Arithmetic::MoellerTrumbore,
     .shapes = TakesShapes::Kernels},
    {.name = "watertight", .summary = "Woop, Benthin and Wald, with padded boxes; no ray slips through a closed mesh",
     .triangle = TRIANGLE_WATERTIGHT, .box = BOX_PADDED, .arithmetic = Arithmetic::Woop, .conservative = true,
     .shapes = TakesShapes::Kernels},
    {.name = "exact",
     .summary = "every answer is that of arithmetic without rounding: filters, then integers; needs float64",
     .triangle = TRIANGLE_EXACT, .box = BOX_RELATIVE, .arithmetic = Arithmetic::Exact, .conservative = true,
     .needs_float64 = true, .shapes = TakesShapes::Host, .leaves_open = true},
    {.name = "double",
     .summary = "watertight in float64, of vertices and rays in double if they are given so; needs float64",
     .triangle = TRIANGLE_DOUBLE, .box = BOX_RELATIVE, .arithmetic = Arithmetic::WoopInDouble, .conservative = true,
     .needs_float64 = true},
};
// clang-format on
inline constexpr std::string_view kDefaultNumeric = "watertight";

/// The arithmetic whose rounding error Oracle::judge allows for a mode. The judge's truth is of double precision and
/// may be wrong where float32 cannot tell, so it judges answers of mode exact as watertight's. The exact oracle judges
/// those without tolerance.
constexpr Arithmetic judged_as(const NumericMode& mode) {
  return mode.arithmetic == Arithmetic::Exact ? Arithmetic::Woop : mode.arithmetic;
}

/// Throws Error(Arguments) unless kernels of a mode can answer in a scene with these kinds of shapes
/// (TreeFacts::shapes).
void check_takes(const NumericMode& mode, std::uint32_t shapes);
/// Returns true if the host traces rays of a mode in such a scene.
constexpr bool host_traces(const NumericMode& mode, std::uint32_t shapes) {
  return shapes && mode.shapes == TakesShapes::Host;
}

/// Throws Error(Arguments) that lists the modes there are.
const NumericMode& find_numeric(std::string_view name);

/// The same for a device. Throws Error(Arguments) that lists the modes of this device if the device lacks what it
/// needs.
const NumericMode& find_numeric(std::string_view name, const DeviceInfo& device);

}  // namespace ballot
