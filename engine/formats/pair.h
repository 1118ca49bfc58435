// The arrays that are uploaded, derived from the reference form. The oracle walks these very arrays.
#pragma once

#include <cstdint>
#include <glm/vec4.hpp>
#include <span>
#include <vector>

#include "engine/bvh/bvh.h"

namespace ballot {

enum class NodeLayout : std::uint32_t {
  Paper = LAYOUT_PAPER,
  Interleaved = LAYOUT_INTERLEAVED,
  Centred = LAYOUT_CENTRED,
  Compact = LAYOUT_COMPACT
};

enum class LeafFormat : std::uint32_t { Vertices = LEAVES_VERTICES, Affine = LEAVES_AFFINE };

/// Texels are 16 bytes of bits (floats by their bit patterns). Formats: shaders/shared/layout.h.
struct PairTree {
  NodeLayout layout = NodeLayout::Interleaved;
  std::vector<glm::uvec4> nodes;     // pairs of siblings; the root itself is not stored
  std::vector<glm::uvec4> leaves;    // leaf blocks of LeafFormat::Vertices
  std::uint32_t root = END_OF_TREE;  // child reference of the root: END_OF_TREE (empty scene), a leaf, or texel 0
  std::uint32_t depth = 0;           // as BvhStats::depth
  Bounds bounds;                     // of the scene, measured from zero
  glm::vec3 origin{0};               // box_origin() of these; boxes in nodes and leaves are measured from it
  Bounds root_box;                   // of the root, as boxes in nodes are

  std::uint32_t pair_texels() const { return PAIR_TEXELS(std::uint32_t(layout)); }
};

/// `boxes` (padded_boxes()), if given, one a node and measured from box_origin(), take the place of the nodes' own, but not that of
/// the boxes in leaf blocks.
/// Throws Error(Work) if a texel index would not fit its field (2^28 texels of leaves, 2^31 of nodes).
PairTree encode_pairs(const Bvh& bvh, std::span<const Triangle> triangles, NodeLayout layout,
                      std::span<const Bounds> boxes = {});

/// The leaf blocks in LeafFormat::Affine, at the same texels as bvh.leaves. Maps are computed in double and rounded once.
/// Throws Error(Work) if the array would be too long for its indices (2^32 texels).
std::vector<glm::uvec4> make_affine_leaves(const PairTree& bvh);

}  // namespace ballot
