// What to ask of a batch of rays, and how.
#pragma once

#include <string>

#include "engine/trace/variant.h"

namespace ballot {

struct Query {
  Want want = Want::Nearest;
  std::string method{kDefaultMethod};
  std::string numeric{kDefaultNumeric};
  Knobs knobs = {};
  /// For method auto: what ray class these are; the name of a ray kind, or of any other sort of which the caller has
  /// many batches alike. Empty: told by how coherent the rays are (coherence.h).
  std::string rays = {};
  bool operator==(const Query&) const = default;
};

}  // namespace ballot
