#include "engine/tree/formats/remains.h"

#include "engine/core/parallel.h"
#include "engine/tree/formats/pair_decode.h"
#include "engine/tree/host/build.h"

namespace ballot {
namespace {

constexpr std::size_t kLeavesAtOnce = 1 << 14;

std::uint32_t leaf_size(std::uint32_t node) { return node & LEAF_BIT ? node & ~LEAF_BIT : 0; }

/// Where a leaf lies in the references, and in the leaf blocks.
struct Place {
  std::uint32_t reference = 0, texel = 0;

  void pass(std::uint32_t node) {
    const std::uint32_t held = leaf_size(node);
    reference += held;
    if (held) texel += LEAF_HEADER_TEXELS + held * TRIANGLE_TEXELS;
  }
};

void restore_leaf(const glm::uvec4* block, const glm::vec3& origin, BvhNode& node, std::span<std::uint32_t> references,
                  std::span<Triangle> triangles) {
  node.lo = as_vec3(block[0]);
  node.hi = as_vec3(block[1]);
  for (int axis = 0; axis < 3; ++axis)
    if (origin[axis] != 0) node.lo[axis] += origin[axis], node.hi[axis] += origin[axis];  // exact: box_origin()
  for (std::uint32_t i = 0; i < node.count; ++i) {
    const glm::uvec4* t = block + LEAF_HEADER_TEXELS + i * TRIANGLE_TEXELS;
    references[node.first + i] = t->w;
    triangles[t->w] = decode_triangle(t);
  }
}

}  // namespace

TreeRemains remains_of(const Bvh& bvh, std::span<const Triangle> triangles) {
  TreeRemains remains;
  remains.nodes.reserve(bvh.nodes.size());
  for (const BvhNode& node : bvh.nodes) remains.nodes.push_back(node.count ? LEAF_BIT | node.count : node.first);
  std::vector<bool> listed(triangles.size());
  for (const std::uint32_t prim : bvh.references) listed[prim] = true;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (listed[i]) continue;
    remains.left_out.push_back(std::uint32_t(i));
    remains.left_out_there.push_back(triangles[i]);
  }
  return remains;
}

void restore(const TreeRemains& remains, std::span<const glm::uvec4> leaves, Bvh& bvh, std::span<Triangle> triangles) {
  const std::vector<std::uint32_t>& nodes = remains.nodes;
  std::vector<Place> places(nodes.size() / kLeavesAtOnce + 1);  // of each chunk's first leaf
  Place next;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (i % kLeavesAtOnce == 0) places[i / kLeavesAtOnce] = next;
    next.pass(nodes[i]);
  }
  const glm::vec3 origin = box_origin(bvh.bounds);
  const bool splits = bvh.references.size() > triangles.size();  // several leaves may have a triangle
  for_chunks(nodes.size(), splits ? nodes.size() : kLeavesAtOnce, [&](std::size_t begin, std::size_t end) {
    Place at = places[begin / kLeavesAtOnce];
    for (std::size_t i = begin; i < end; at.pass(nodes[i++])) {
      const std::uint32_t held = leaf_size(nodes[i]);
      bvh.nodes[i] = {{}, {}, held, held ? at.reference : nodes[i]};
      if (held) restore_leaf(leaves.data() + at.texel, origin, bvh.nodes[i], bvh.references, triangles);
    }
  });
  unite_children(bvh.nodes);
  for (std::size_t i = 0; i < remains.left_out.size(); ++i) triangles[remains.left_out[i]] = remains.left_out_there[i];
}

}  // namespace ballot
