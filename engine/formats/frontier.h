// The frontier: a cut through the top of the tree with few nodes. The lanes of a subgroup test one node each.
#pragma once

#include "engine/formats/pair.h"

namespace ballot {

/// Returns at most `nodes` nodes whose subtrees together hold every leaf once. Starting at the root, the node with the
/// largest surface area is opened until there are `nodes` nodes. The nodes are listed once for each octant of
/// directions, front to back as far as the boxes of siblings tell. Each list is filled up to `nodes` with empty nodes;
/// in an empty scene all are empty. Format: shaders/shared/layout.h.
std::vector<glm::uvec4> encode_frontier(const PairTree& binary, std::uint32_t nodes);

}  // namespace ballot
