#include "engine/formats/bvh4.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/formats/collapse.h"

namespace ballot {
namespace {

constexpr int kSteps = 255;  // of a grid, along each axis
// The smallest step of a grid. Its products with directions are not denormal, so no device flushes them to zero.
constexpr float kSmallestStep = 0x1p-120f;

/// The difference to - from, kept exactly as rounded + rest.
///
/// Source: Ole Moeller. Quasi double-precision in floating point addition. BIT 5, 1965.
struct Difference {
  double rounded, rest;
  Difference(float to, float from) : rounded(double(to) - from) {
    const double part = rounded - to;
    rest = (double(to) - (rounded - part)) - (double(from) + part);
  }
  bool at_least(double x) const { return x < rounded || (x == rounded && rest >= 0); }
  bool at_most(double x) const { return x > rounded || (x == rounded && rest <= 0); }
};

/// The grid of a node along one axis: the positions first + q * step with q from 0 to 255. The products are exact in
/// double precision.
struct Grid {
  float first, step;
  Grid(float lo, float hi) : first(lo) {
    const Difference extent(hi, lo);
    step = std::max(float(extent.rounded / kSteps), kSmallestStep);
    while (!extent.at_most(double(step) * kSteps)) step = std::nextafter(step, std::numeric_limits<float>::infinity());
  }
  /// Returns the largest q whose position is not above x.
  std::uint32_t below(float x) const {
    const Difference d(x, first);
    int q = std::clamp(int(d.rounded / step), 0, kSteps);
    while (q < kSteps && d.at_least(double(step) * (q + 1))) ++q;
    while (!d.at_least(double(step) * q)) --q;
    return std::uint32_t(q);
  }
  /// Returns the smallest q whose position is not below x.
  std::uint32_t above(float x) const {
    const Difference d(x, first);
    int q = std::clamp(int(d.rounded / step), 0, kSteps);
    while (!d.at_most(double(step) * q)) ++q;
    while (q > 0 && d.at_most(double(step) * (q - 1))) --q;
    return std::uint32_t(q);
  }
};

void add_bvh4_node(std::span<const DeviceChild> children, std::vector<glm::uvec4>& out) {
  Bounds all = children[0].box;
  for (const DeviceChild& c : children) all = {glm::min(all.lo, c.box.lo), glm::max(all.hi, c.box.hi)};
  glm::uvec4 first{}, lower{}, upper{}, refs{};
  for (int axis = 0; axis < 3; ++axis) {
    const Grid grid(all.lo[axis], all.hi[axis]);
    first[axis] = std::bit_cast<std::uint32_t>(grid.first);
    (axis == 0 ? first : axis == 1 ? lower : upper).w = std::bit_cast<std::uint32_t>(grid.step);
    for (std::uint32_t i = 0; i < BVH4_CHILDREN; ++i) {
      const bool none = i >= children.size();
      lower[axis] |= (none ? kSteps : grid.below(children[i].box.lo[axis])) << 8 * i;
      upper[axis] |= (none ? 0 : grid.above(children[i].box.hi[axis])) << 8 * i;
    }
  }
  for (std::size_t i = 0; i < BVH4_CHILDREN; ++i) {
    const std::uint32_t ref = i < children.size() ? children[i].ref : END_OF_TREE;
    refs[int(i)] = is_leaf(ref) ? ref : ref * BVH4_NODE_TEXELS;
  }
  out.insert(out.end(), {first, lower, upper, refs});
}

}  // namespace

Bvh4Tree encode_bvh4(const PairTree& binary) {
  Bvh4Tree out;
  out.root = binary.root;
  if (binary.root == END_OF_TREE || is_leaf(binary.root)) return out;
  const CollapsedBvh tree = collapse(binary, BVH4_CHILDREN, LEAF_BIT / BVH4_NODE_TEXELS);
  out.depth = tree.depth;
  out.children = std::uint32_t(tree.children.size());
  out.nodes.reserve(tree.ends.size() * BVH4_NODE_TEXELS);
  for (std::size_t i = 0; i < tree.ends.size(); ++i) add_bvh4_node(tree.children_of(i), out.nodes);
  return out;
}

}  // namespace ballot
