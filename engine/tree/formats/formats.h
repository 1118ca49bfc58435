// The registry of tree formats: how a tree lies on the device for the methods that walk it. A new format is an encoder
// (a .h and a .cpp file here), a row below and a GLSL file in shaders/lib/tree/; a method names its format
// (engine/answer/methods.h).
//
// Every format is derived from the pair tree (pair.h): the binary tree, two siblings a record, with the leaves that all
// formats share. Texels are 16 bytes; shaders/shared/layout.h has the bytes of each format.
#pragma once

#include <string_view>
#include <vector>

#include "engine/tree/formats/bvh4.h"
#include "engine/tree/formats/bvh8.h"
#include "engine/tree/formats/frontier.h"
#include "engine/tree/formats/wide8.h"

namespace ballot {

enum class TreeFormatId { Pair, Bvh4, Bvh8, Wide8, Frontier };

/// When kernels read the pair tree besides their own format.
enum class Pairs { Always, WithFallback, Never };

/// A row of the registry of tree formats.
struct TreeFormat {
  TreeFormatId id;
  std::string_view name;
  std::string_view summary;
  /// Returns the texels of the format. Null: they are the pair tree's own. `size`: number of nodes in the frontier.
  std::vector<glm::uvec4> (*encode)(const PairTree& pairs, std::uint32_t size) = nullptr;
  Pairs pairs = Pairs::Always;
  std::uint32_t pushes = 1;    // the most entries that one step of a ray pushes on its stack
  bool padded = false;         // boxes can be widened once for all rays (padding.h)
  bool follows_pairs = false;  // encoded from the pairs that the kernel reads, in their layout and padding
  bool on_device = false;      // the device writes it too, from pairs that lie there
  // Of formats that the pair tree is collapsed into (collapse.h): children a node, texels a node, and how many nodes
  // there may be.
  std::uint32_t width = 0, node_texels = 0;
  std::uint64_t most_nodes = 0;
  bool collapsed() const { return width > 0; }
  /// True if a walk may begin at any node of the pair tree, because kernels always read that.
  bool begins_at_pairs() const { return pairs == Pairs::Always; }
};

// clang-format off
inline constexpr TreeFormat kTreeFormats[] = {
    {.id = TreeFormatId::Pair, .name = "pair",
     .summary = "two siblings in 64 bytes, or 48 (knob layout)", .padded = true, .on_device = true},
    {.id = TreeFormatId::Bvh4, .name = "bvh4",
     .summary = "up to four children in 64 bytes, boxes quantised to 8 bits",
     .encode = [](const PairTree& pairs, std::uint32_t) { return encode_bvh4(pairs).nodes; },
     .pairs = Pairs::Never, .pushes = BVH4_CHILDREN - 1, .on_device = true,
     .width = BVH4_CHILDREN, .node_texels = BVH4_NODE_TEXELS, .most_nodes = kBvh4MostNodes},
    {.id = TreeFormatId::Bvh8, .name = "bvh8",
     .summary = "up to eight children in 80 bytes, boxes quantised to 8 bits",
     .encode = [](const PairTree& pairs, std::uint32_t) { return encode_bvh8(pairs).texels; },
     .pairs = Pairs::Never, .pushes = 2, .padded = true, .on_device = true,
     .width = BVH8_CHILDREN, .node_texels = BVH8_NODE_TEXELS, .most_nodes = kBvh8MostNodes},
    {.id = TreeFormatId::Wide8, .name = "wide8",
     .summary = "up to eight children with float32 boxes, for a subgroup that tests a child a lane",
     .encode = [](const PairTree& pairs, std::uint32_t) { return encode_wide8(pairs).nodes; },
     .pairs = Pairs::WithFallback, .on_device = true,
     .width = WIDE8_CHILDREN, .node_texels = WIDE8_NODE_TEXELS, .most_nodes = WIDE8_MAX_NODES},
    {.id = TreeFormatId::Frontier, .name = "frontier",
     .summary = "32 or 64 nodes near the root that hold every leaf once, beside the pair tree",
     .encode = encode_frontier, .padded = true, .follows_pairs = true, .on_device = true},
};
// clang-format on

constexpr const TreeFormat& format_of(TreeFormatId id) { return kTreeFormats[int(id)]; }

constexpr bool formats_are_in_order() {
  for (const TreeFormat& f : kTreeFormats)
    if (&format_of(f.id) != &f) return false;
  return true;
}
static_assert(formats_are_in_order(), "rows of kTreeFormats stand in the order of TreeFormatId");

}  // namespace ballot
