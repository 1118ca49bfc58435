// What the host keeps of a mesh and its tree while the device has the leaf blocks: enough to have all of it again.
#pragma once

#include <cstdint>
#include <glm/vec4.hpp>
#include <span>
#include <vector>

#include "engine/tree/host/bvh.h"

namespace ballot {

/// A tree and its triangles without what the leaf blocks of LeafFormat::Vertices tell: four bytes a node.
struct TreeRemains {
  std::vector<std::uint32_t> nodes;      // of a leaf its count, with LEAF_BIT; of an inner node its first child
  std::vector<std::uint32_t> left_out;   // triangles that no leaf has, in order
  UnsetVector<Triangle> left_out_there;  // these
};

/// Returns the remains of a tree, whose children come after their parents, and whose inner boxes are those of their
/// children united, as in all trees that are built here.
TreeRemains remains_of(const Bvh& bvh, std::span<const Triangle> triangles);

/// Writes the nodes, references and triangles again, in place, as they were, but for the order of the references: it is
/// now that of the leaf blocks. `leaves` are the blocks that encode_pairs() made of the tree. bvh.bounds must be as
/// they were, and the arrays as large. Runs on all cores.
void restore(const TreeRemains& remains, std::span<const glm::uvec4> leaves, Bvh& bvh, std::span<Triangle> triangles);

}  // namespace ballot
