// Encodes the binary tree for the device, from its reference form.
#include "engine/tree/formats/pair.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/core/error.h"
#include "engine/core/parallel.h"
#include "engine/tree/formats/pair_decode.h"

namespace ballot {
namespace {

using Texel = glm::uvec4;

std::uint32_t bits(float x) { return std::bit_cast<std::uint32_t>(x); }
Texel texel(const glm::vec3& v, std::uint32_t w) { return {bits(v.x), bits(v.y), bits(v.z), w}; }

constexpr std::uint64_t kMaxLeafTexels = std::uint64_t{1} << LEAF_COUNT_SHIFT;
constexpr std::uint64_t kMaxNodeTexels = std::uint64_t{1} << 31;

void check_sizes(const Bvh& bvh, std::size_t triangles) {
  const std::uint64_t nodes = bvh.nodes.size() * 2;
  const std::uint64_t leaves =
      std::uint64_t{bvh.stats.leaves} * LEAF_HEADER_TEXELS + bvh.references.size() * TRIANGLE_TEXELS;
  if (nodes > kMaxNodeTexels || leaves > kMaxLeafTexels)
    fail(Failure::Work,
         "bvh: {} nodes and {} triangle references take {} and {} texels on the device, but a child reference can "
         "number {} and {} (shaders/shared/layout.h); {}",
         bvh.nodes.size(), bvh.references.size(), nodes, leaves, kMaxNodeTexels, kMaxLeafTexels,
         bvh.references.size() > triangles ? "a smaller split_budget makes fewer references"
                                           : "use several scenes of fewer triangles");
}

// Writes the block of a leaf at a texel. Returns the child reference of the leaf.
std::uint32_t write_leaf(const BvhNode& leaf, const Bounds& box, const Bvh& bvh, std::span<const Triangle> triangles,
                         std::uint32_t at, std::vector<Texel>& leaves) {
  Texel* out = leaves.data() + at;
  *out++ = texel(box.lo, leaf.count);
  *out++ = texel(box.hi, 0);
  for (std::uint32_t i = 0; i < leaf.count; ++i) {
    const std::uint32_t prim = bvh.references[leaf.first + i];
    const Triangle& t = triangles[prim];
    for (int axis = 0; axis < 3; ++axis) *out++ = texel({t[0][axis], t[1][axis], t[2][axis]}, prim);
  }
  return leaf_ref(leaf.count, at);
}

std::uint32_t leaf_texels(const BvhNode& node) {
  return node.count == 0 ? 0 : LEAF_HEADER_TEXELS + node.count * TRIANGLE_TEXELS;
}

// Returns the texel at which the pair of an inner node's children starts. Nodes 0 and 1 are not stored.
std::uint32_t pair_texel(const BvhNode& inner, std::uint32_t pair_texels) {
  return (inner.first / 2 - 1) * pair_texels;
}

void write_paper(const Bounds& box, std::uint32_t count, std::uint32_t ref, Texel* out) {
  out[0] = texel(box.lo, bits(box.hi.x));
  out[1] = {bits(box.hi.y), bits(box.hi.z), count, count == 0 ? ref : leaf_texel(ref)};
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

void write_interleaved(const Bounds& l, const Bounds& r, std::uint32_t left, std::uint32_t right, Texel* out) {
  out[0] = {bits(l.lo.x), bits(l.hi.x), bits(l.lo.y), bits(l.hi.y)};
  out[1] = {bits(r.lo.x), bits(r.hi.x), bits(r.lo.y), bits(r.hi.y)};
  out[2] = {bits(l.lo.z), bits(l.hi.z), bits(r.lo.z), bits(r.hi.z)};
  out[3] = {left, right, 0, 0};
}

/// Packs the upper 16 bits of two non-negative floats into one word, those of `above` in the upper half. Read as a
/// float, the whole word is not less than `above`, and its lower half shifted up by 16 bits is not less than `below`.
std::uint32_t upper_halves(float above, float below) {
  std::uint32_t low = bits(below) >> 16, high = bits(above) >> 16;
  if (as_float(low << 16) < below) ++low;
  if (as_float(high << 16 | low) < above) ++high;
  return high << 16 | low;
}

void write_compact(const Bounds& l, const Bounds& r, std::uint32_t left, std::uint32_t right, Texel* out) {
  out[0] = texel(l.lo, left);
  out[1] = texel(r.lo, right);
  out[2] = {upper_halves(l.hi.x, r.hi.x), upper_halves(l.hi.y, r.hi.y), upper_halves(l.hi.z, r.hi.z), 0};
}

/// Encodes a tree on all cores, in chunks of nodes. Leaf blocks lie in the order of the nodes.
class PairEncoder {
 public:
  PairEncoder(const Bvh& bvh, std::span<const Triangle> triangles, std::span<const Bounds> boxes, PairTree& out)
      : bvh_(bvh), triangles_(triangles), boxes_(boxes), out_(out) {}

  void run() {
    const std::size_t count = bvh_.nodes.size();
    starts_.resize(count / kChunk + 2);
    for_chunks(count, kChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) starts_[begin / kChunk + 1] += leaf_texels(bvh_.nodes[i]);
    });
    for (std::size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
    out_.nodes.resize((count / 2 - 1) * out_.pair_texels());
    out_.leaves.resize(starts_.back());
    for_chunks(count, kChunk, [&](std::size_t begin, std::size_t end) { encode(begin, end); });
    out_.root_box = box_of(0);
  }

 private:
  static constexpr std::size_t kChunk = 1 << 14;  // even: siblings stay together

  Bounds own_box(const BvhNode& node) const { return {node.lo - out_.origin, node.hi - out_.origin}; }
  Bounds box_of(std::size_t node) const { return boxes_.empty() ? own_box(bvh_.nodes[node]) : boxes_[node]; }

  /// Returns the child reference of a node, and writes its block if it is a leaf.
  std::uint32_t ref_of(const BvhNode& node, std::uint32_t& leaf_at) const {
    if (node.count == 0) return pair_texel(node, out_.pair_texels());
    const std::uint32_t at = leaf_at;
    leaf_at += leaf_texels(node);
    return write_leaf(node, own_box(node), bvh_, triangles_, at, out_.leaves);
  }

  void encode(std::size_t begin, std::size_t end) const {
    std::uint32_t leaf_at = starts_[begin / kChunk];
    for (std::size_t i = begin; i < end; i += 2) {
      const std::uint32_t left = ref_of(bvh_.nodes[i], leaf_at);
      if (i == 0) {  // the root has no sibling
        out_.root = left;
        continue;
      }
      write_pair(i, left, ref_of(bvh_.nodes[i + 1], leaf_at));
    }
  }

  void write_pair(std::size_t i, std::uint32_t left_ref, std::uint32_t right_ref) const {
    const Bounds left = box_of(i), right = box_of(i + 1);
    Texel* to = out_.nodes.data() + (i / 2 - 1) * out_.pair_texels();
    if (out_.layout == NodeLayout::Paper) {
      write_paper(left, bvh_.nodes[i].count, left_ref, to);
      write_paper(right, bvh_.nodes[i + 1].count, right_ref, to + 2);
    } else if (out_.layout == NodeLayout::Compact) {
      write_compact(centred(left), centred(right), left_ref, right_ref, to);
    } else if (out_.layout == NodeLayout::Centred) {
      write_interleaved(centred(left), centred(right), left_ref, right_ref, to);
    } else {
      write_interleaved(left, right, left_ref, right_ref, to);
    }
  }

  const Bvh& bvh_;
  const std::span<const Triangle> triangles_;
  const std::span<const Bounds> boxes_;
  PairTree& out_;
  std::vector<std::uint32_t> starts_;  // the texel of the first leaf of each chunk
};

}  // namespace

PairTree encode_pairs(const Bvh& bvh, std::span<const Triangle> triangles, NodeLayout layout,
                      std::span<const Bounds> boxes, PairTree room) {
  PairTree out = std::move(room);
  out.layout = layout;
  out.root = END_OF_TREE;
  out.depth = bvh.stats.depth;
  out.bounds = bvh.bounds;
  out.origin = glm::vec3(0);
  out.root_box = {};
  if (bvh.nodes.empty()) {
    out.nodes.clear();
    out.leaves.clear();
    return out;
  }
  out.origin = box_origin(bvh.bounds);
  check_sizes(bvh, triangles.size());
  PairEncoder(bvh, triangles, boxes, out).run();
  return out;
}

}  // namespace ballot
