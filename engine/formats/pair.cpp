// Encodes the binary tree for the device, from its reference form.
#include "engine/formats/pair.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/core/error.h"
#include "engine/formats/pair_decode.h"

namespace ballot {
namespace {

using Texel = glm::uvec4;

std::uint32_t bits(float x) { return std::bit_cast<std::uint32_t>(x); }
Texel texel(const glm::vec3& v, std::uint32_t w) { return {bits(v.x), bits(v.y), bits(v.z), w}; }

constexpr std::uint64_t kMaxLeafTexels = std::uint64_t{1} << LEAF_COUNT_SHIFT;
constexpr std::uint64_t kMaxNodeTexels = std::uint64_t{1} << 31;

void check_sizes(const Bvh& bvh) {
  const std::uint64_t nodes = bvh.nodes.size() * 2;
  const std::uint64_t leaves =
      std::uint64_t{bvh.stats.leaves} * LEAF_HEADER_TEXELS + bvh.references.size() * TRIANGLE_TEXELS;
  if (nodes > kMaxNodeTexels || leaves > kMaxLeafTexels)
    fail(Failure::Work,
         "bvh: {} nodes and {} triangle references take {} and {} texels on the device, but a child reference can "
         "number {} and {} (shaders/shared/layout.h); a smaller split_budget makes fewer references",
         bvh.nodes.size(), bvh.references.size(), nodes, leaves, kMaxNodeTexels, kMaxLeafTexels);
}

// Appends the block of a leaf. Returns the child reference of the leaf.
std::uint32_t add_leaf(const BvhNode& leaf, const Bounds& box, const Bvh& bvh, std::span<const Triangle> triangles,
                       std::vector<Texel>& out) {
  const std::uint32_t at = static_cast<std::uint32_t>(out.size());
  out.push_back(texel(box.lo, leaf.count));
  out.push_back(texel(box.hi, 0));
  for (std::uint32_t i = 0; i < leaf.count; ++i) {
    const std::uint32_t prim = bvh.references[leaf.first + i];
    const Triangle& t = triangles[prim];
    for (int axis = 0; axis < 3; ++axis) out.push_back(texel({t[0][axis], t[1][axis], t[2][axis]}, prim));
  }
  return leaf_ref(leaf.count, at);
}

// Returns the texel at which the pair of an inner node's children starts. Nodes 0 and 1 are not stored.
std::uint32_t pair_texel(const BvhNode& inner, std::uint32_t pair_texels) {
  return (inner.first / 2 - 1) * pair_texels;
}

void add_paper(const Bounds& box, std::uint32_t count, std::uint32_t ref, std::vector<Texel>& out) {
  out.push_back(texel(box.lo, bits(box.hi.x)));
  out.push_back({bits(box.hi.y), bits(box.hi.z), count, count == 0 ? ref : leaf_texel(ref)});
}

// Returns the centre (as lo) and half extent (as hi) of a box. The half extent is rounded up, so that no point of the
// box is lost.
Bounds centred(const Bounds& box) {
  Bounds out;
  for (int axis = 0; axis < 3; ++axis) {
    const double lo = box.lo[axis], hi = box.hi[axis];
    const float centre = float(0.5 * (lo + hi));
    const double half = std::max(hi - double(centre), double(centre) - lo);
    float up = float(half);
    if (double(up) < half) up = std::nextafter(up, std::numeric_limits<float>::infinity());
    out.lo[axis] = centre;
    out.hi[axis] = up;
  }
  return out;
}

void add_interleaved(const Bounds& l, const Bounds& r, std::uint32_t left, std::uint32_t right,
                     std::vector<Texel>& out) {
  out.push_back({bits(l.lo.x), bits(l.hi.x), bits(l.lo.y), bits(l.hi.y)});
  out.push_back({bits(r.lo.x), bits(r.hi.x), bits(r.lo.y), bits(r.hi.y)});
  out.push_back({bits(l.lo.z), bits(l.hi.z), bits(r.lo.z), bits(r.hi.z)});
  out.push_back({left, right, 0, 0});
}

/// Packs the upper 16 bits of two non-negative floats into one word, those of `above` in the upper half. Read as a
/// float, the whole word is not less than `above`, and its lower half shifted up by 16 bits is not less than `below`.
std::uint32_t upper_halves(float above, float below) {
  std::uint32_t low = bits(below) >> 16, high = bits(above) >> 16;
  if (as_float(low << 16) < below) ++low;
  if (as_float(high << 16 | low) < above) ++high;
  return high << 16 | low;
}

void add_compact(const Bounds& l, const Bounds& r, std::uint32_t left, std::uint32_t right, std::vector<Texel>& out) {
  out.push_back(texel(l.lo, left));
  out.push_back(texel(r.lo, right));
  out.push_back({upper_halves(l.hi.x, r.hi.x), upper_halves(l.hi.y, r.hi.y), upper_halves(l.hi.z, r.hi.z), 0});
}

}  // namespace

PairTree encode_pairs(const Bvh& bvh, std::span<const Triangle> triangles, NodeLayout layout,
                      std::span<const Bounds> boxes) {
  PairTree out;
  out.layout = layout;
  out.depth = bvh.stats.depth;
  out.bounds = bvh.bounds;
  if (bvh.nodes.empty()) return out;
  out.origin = box_origin(bvh.bounds);
  check_sizes(bvh);
  out.nodes.reserve((bvh.nodes.size() / 2 - 1) * out.pair_texels());
  out.leaves.reserve(bvh.stats.leaves * LEAF_HEADER_TEXELS + bvh.references.size() * TRIANGLE_TEXELS);
  const auto own_box = [&](const BvhNode& node) { return Bounds{node.lo - out.origin, node.hi - out.origin}; };
  const auto ref_of = [&](const BvhNode& node) {
    return node.count == 0 ? pair_texel(node, out.pair_texels())
                           : add_leaf(node, own_box(node), bvh, triangles, out.leaves);
  };
  const auto box_of = [&](std::size_t node) { return boxes.empty() ? own_box(bvh.nodes[node]) : boxes[node]; };
  out.root = ref_of(bvh.nodes[0]);
  out.root_box = box_of(0);
  for (std::size_t i = 2; i < bvh.nodes.size(); i += 2) {
    const Bounds left = box_of(i), right = box_of(i + 1);
    const std::uint32_t left_ref = ref_of(bvh.nodes[i]);
    const std::uint32_t right_ref = ref_of(bvh.nodes[i + 1]);
    if (layout == NodeLayout::Paper) {
      add_paper(left, bvh.nodes[i].count, left_ref, out.nodes);
      add_paper(right, bvh.nodes[i + 1].count, right_ref, out.nodes);
    } else if (layout == NodeLayout::Compact) {
      add_compact(centred(left), centred(right), left_ref, right_ref, out.nodes);
    } else if (layout == NodeLayout::Centred) {
      add_interleaved(centred(left), centred(right), left_ref, right_ref, out.nodes);
    } else {
      add_interleaved(left, right, left_ref, right_ref, out.nodes);
    }
  }
  return out;
}

}  // namespace ballot
