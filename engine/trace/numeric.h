// Every numeric mode there is: a line here and a file shaders/lib/numeric_<name>.glsl, included by
// shaders/lib/numeric.glsl.
#pragma once

#include <string_view>

#include "shaders/shared/variant.h"

namespace ballot {

struct NumericMode {
  std::string_view name;
  int value;          // BALLOT_NUMERIC
  bool conservative;  // answers are equal bit for bit over methods, orders, subgroup and workgroup sizes
  std::string_view summary;
};

inline constexpr NumericMode kNumericModes[] = {
    {"plain", NUMERIC_PLAIN, false, "Moeller-Trumbore, boxes as they are; rays can slip between triangles"},
    {"watertight", NUMERIC_WATERTIGHT, true,
     "Woop, Benthin and Wald, padded boxes; no ray slips through a closed mesh"},
};
inline constexpr std::string_view kDefaultNumeric = "watertight";

/// Throws Error(Arguments) that lists the modes there are.
const NumericMode& find_numeric(std::string_view name);

}  // namespace ballot
