// A query: the hits to find for a batch of rays, and the method that finds them.
#pragma once

#include <string>

#include "engine/trace/variant.h"

namespace ballot {

struct Query {
  Want want = Want::Nearest;
  std::string method{kDefaultMethod};
  std::string numeric{kDefaultNumeric};
  Knobs knobs = {};
  /// For method auto: the ray class. It is the name of a ray kind, or any other name that the caller gives to batches
  /// that are alike. Empty: found from how coherent the rays are (auto/coherence.h).
  std::string rays = {};
  bool operator==(const Query&) const = default;
};

}  // namespace ballot
