// The frontier: a cut of few nodes through the top of the tree. Each lane of a subgroup tests one in a step.
#pragma once

#include "engine/tree/formats/pair.h"

namespace ballot {

/// Returns the frontier: at most `nodes` nodes whose subtrees together hold every leaf once. From the root on, the
/// inner node with the largest surface area is replaced by its children until there are `nodes` nodes or only leaves.
/// They are listed once for each octant of directions, front to back as far as the boxes of siblings tell. Each list is
/// filled up to `nodes` with empty nodes; in an empty scene all are empty. Format: shaders/shared/layout.h.
std::vector<glm::uvec4> encode_frontier(const PairTree& binary, std::uint32_t nodes);

}  // namespace ballot
