// The binary tree as it is uploaded to the device, derived from the reference form. The oracles traverse the same
// arrays.
#pragma once

#include <cstdint>
#include <glm/vec4.hpp>
#include <span>
#include <vector>

#include "engine/tree/host/bvh.h"

namespace ballot {

/// The layout of a pair of siblings on the device (shaders/shared/layout.h).
enum class NodeLayout : std::uint32_t {
  Paper = LAYOUT_PAPER,
  Interleaved = LAYOUT_INTERLEAVED,
  Centred = LAYOUT_CENTRED,
  Compact = LAYOUT_COMPACT
};

/// The layout of the triangles of a leaf on the device (shaders/shared/layout.h).
enum class LeafFormat : std::uint32_t { Vertices = LEAVES_VERTICES, Affine = LEAVES_AFFINE };

/// The binary tree on the device, stored as pairs of siblings. A texel is 16 bytes; floats are stored as their bit
/// patterns. Formats: shaders/shared/layout.h.
struct PairTree {
  NodeLayout layout = NodeLayout::Interleaved;
  std::vector<glm::uvec4> nodes;     // pairs of siblings; the root itself is not stored
  std::vector<glm::uvec4> leaves;    // leaf blocks of LeafFormat::Vertices
  std::uint32_t root = END_OF_TREE;  // child reference of the root: END_OF_TREE (empty scene), a leaf, or texel 0
  std::uint32_t depth = 0;           // as BvhStats::depth
  Bounds bounds;                     // of the scene, measured from zero, scene units
  glm::vec3 origin{0};               // box_origin() of the bounds; boxes in nodes and leaves are measured from it
  Bounds root_box;                   // box of the root, measured and padded as the boxes in nodes

  std::uint32_t pair_texels() const { return PAIR_TEXELS(std::uint32_t(layout)); }
};

/// Encodes a tree for the device. `boxes`, if given, is the result of padded_boxes(): one box per node, measured from
/// box_origin(). These boxes replace the nodes' own, but not the boxes in leaf blocks. `room` is a tree that is no
/// longer needed: its memory is used again. Runs on all cores. Throws Error(Work) if a texel index would not fit its
/// field (2^28 texels of leaves, 2^31 of nodes).
PairTree encode_pairs(const Bvh& bvh, std::span<const Triangle> triangles, NodeLayout layout,
                      std::span<const Bounds> boxes = {}, PairTree room = {});

/// Returns the leaf blocks in LeafFormat::Affine, at the same texels as in bvh.leaves. Maps are computed in double
/// precision and rounded once. Throws Error(Work) if the array would be too long for its indices (2^32 texels).
std::vector<glm::uvec4> make_affine_leaves(const PairTree& bvh);

}  // namespace ballot
