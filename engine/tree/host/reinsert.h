// Lowers the cost of a finished tree: subtrees move to where they cost less.
#pragma once

#include "engine/tree/host/bvh.h"

namespace ballot {

/// Returns a tree of the same leaves whose inner nodes cost less by the surface area heuristic. Each node is taken out
/// and put back where the tree's cost falls most, as far as a bounded search finds, until a pass over all nodes saves
/// less than a hundredth. A search looks at a bounded number of nodes. Leaves keep their boxes and references; siblings
/// and order change. The depth does not grow beyond twice that of a balanced tree and 10. Runs on all cores; the result
/// does not depend on their number. Takes about 50 bytes a node.
///
/// Sources: Daniel Meister, Jiri Bittner. Parallel Reinsertion for Bounding Volume Hierarchy Optimization. Computer
/// Graphics Forum 37(2), 2018. Jiri Bittner, Michal Hapala, Vlastimil Havran. Fast Insertion-Based Optimization of
/// Bounding Volume Hierarchies. Computer Graphics Forum 32(1), 2013.
Bvh reinsert_subtrees(Bvh bvh, const BuildSettings& settings);

}  // namespace ballot
