// The query: what to find for a batch of rays, and by which kernel.
#pragma once

#include <string>

#include "engine/answer/variant.h"

namespace ballot {

/// What to find for rays, and by which method, numeric mode and knobs. The default finds nearest hits with method auto.
struct Query {
  Want want = Want::Nearest;
  std::string method{kDefaultMethod};
  std::string numeric{kDefaultNumeric};
  Knobs knobs = {};
  /// The ray class, for method auto: the name of a ray kind, or "coherent", "mixed" or "incoherent" (auto/coherence.h).
  /// Any other name, or none: it looks at the rays.
  std::string rays = {};
  bool operator==(const Query&) const = default;
};

}  // namespace ballot
