// The registry of origin offset policies: how far a secondary ray starts from the surface that it leaves. A new policy
// is a line here, a number in shaders/shared/render.h and a file shaders/lib/origin/<name>.glsl that
// shaders/lib/origin/surface.glsl includes.
#pragma once

#include <string_view>

#include "engine/core/registry.h"
#include "shaders/shared/render.h"

namespace ballot {

struct OffsetPolicy {
  std::string_view name;
  int value;  // BALLOT_ORIGIN
  std::string_view summary;
};

inline constexpr OffsetPolicy kOffsetPolicies[] = {
    {"constant", ORIGIN_CONSTANT, "a share of the scene's diagonal along the normal, 1e-4 unless told otherwise"},
    {"ulp", ORIGIN_ULP, "256 units in the last place along the normal (Waechter and Binder 2019)"},
    {"pbrt", ORIGIN_PBRT, "the bound of the point's rounding error (Pharr, Jakob and Humphreys, section 6.8)"},
    {"proved", ORIGIN_PROVED, "the smallest offset proved to leave the triangle, in modes watertight and exact alone"},
    {"bounded", ORIGIN_BOUNDED, "the same, or more where measurements of the other modes ask for it"},
};
inline constexpr std::string_view kDefaultOffset = "bounded";

/// Returns the policy of this name. Throws Error(Arguments) that lists the known names.
inline const OffsetPolicy& find_offset_policy(std::string_view name) {
  return find_named(kOffsetPolicies, name, "offset policy");
}

}  // namespace ballot
