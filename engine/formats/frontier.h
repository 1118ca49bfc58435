// The top of the tree cut off along a line of few nodes, which the lanes of a subgroup test a node each.
#pragma once

#include "engine/formats/pair.h"

namespace ballot {

/// At most `nodes` nodes whose subtrees hold every leaf once: from the root, the node of the largest surface is opened until
/// there are so many. Listed once for each octant of directions, front to back as far as the boxes of siblings tell, and
/// filled up with empty ones. Format: shaders/shared/layout.h. An empty scene has nothing but these.
std::vector<glm::uvec4> encode_frontier(const PairTree& binary, std::uint32_t nodes);

}  // namespace ballot
