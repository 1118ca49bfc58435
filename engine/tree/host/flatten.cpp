// Converts the builder's tree to the reference form and computes its statistics.
#include <algorithm>
#include <glm/common.hpp>

#include "engine/core/error.h"
#include "engine/tree/host/build.h"

namespace ballot {
namespace {

// One past the largest index of a node or reference. Texel indices in device layouts must keep the top bit clear.
constexpr std::size_t kMaxIndex = std::size_t{1} << 31;

// A node of the builder's tree and its place in the reference form.
struct PlacedNode {
  const BuildNode* from;
  std::uint32_t index;
  std::uint32_t inner_above;  // inner nodes on the path from the root, without this one
};

}  // namespace

void unite_children(std::vector<BvhNode>& nodes) {
  for (std::size_t i = nodes.size(); i-- > 0;) {
    BvhNode& node = nodes[i];
    if (i == 1 || node.count > 0) continue;
    const BvhNode& left = nodes[node.first];
    const BvhNode& right = nodes[node.first + 1];
    node.lo = glm::min(left.lo, right.lo);
    node.hi = glm::max(left.hi, right.hi);
  }
}

namespace {

void place_leaf(const BuildNode& from, BvhNode& node, Bvh& bvh) {
  if (bvh.references.size() + from.count >= kMaxIndex) fail(Failure::Work, "bvh: more than 2^31 triangle references");
  node = {from.box.lo, from.box.hi, from.count, static_cast<uint>(bvh.references.size())};
  bvh.references.insert(bvh.references.end(), from.prims, from.prims + from.count);
  ++bvh.stats.leaves;
  bvh.stats.largest_leaf = std::max(bvh.stats.largest_leaf, from.count);
}

}  // namespace

double sah_cost(const Bvh& bvh, const BuildSettings& settings) {
  const double whole = half_area(bvh.nodes[0].lo, bvh.nodes[0].hi);
  double cost = 0;
  for (std::size_t i = 0; i < bvh.nodes.size(); ++i) {
    if (i == 1) continue;
    const BvhNode& node = bvh.nodes[i];
    const double share = whole > 0 ? half_area(node.lo, node.hi) / whole : 1;
    cost +=
        share * (node.count == 0 ? double{settings.traversal_cost} : double{settings.intersection_cost} * node.count);
  }
  return cost;
}

Bvh flatten(const BuildNode* root, const BuildSettings& settings) {
  Bvh bvh;
  if (root == nullptr) return bvh;
  bvh.nodes.resize(2);
  std::vector<PlacedNode> todo{{root, 0, 0}};
  while (!todo.empty()) {
    const PlacedNode place = todo.back();
    todo.pop_back();
    if (place.from->count > 0) {
      place_leaf(*place.from, bvh.nodes[place.index], bvh);
      bvh.stats.depth = std::max(bvh.stats.depth, place.inner_above);
      continue;
    }
    const std::size_t first = bvh.nodes.size();
    if (first + 2 > kMaxIndex) fail(Failure::Work, "bvh: more than 2^31 nodes");
    bvh.nodes.resize(first + 2);
    bvh.nodes[place.index].count = 0;
    bvh.nodes[place.index].first = static_cast<uint>(first);
    for (const int side : {1, 0})
      todo.push_back({place.from->child[side], static_cast<std::uint32_t>(first + side), place.inner_above + 1});
  }
  unite_children(bvh.nodes);
  bvh.bounds = {bvh.nodes[0].lo, bvh.nodes[0].hi};
  bvh.stats.nodes = static_cast<std::uint32_t>(bvh.nodes.size() - 1);
  bvh.stats.references = static_cast<std::uint32_t>(bvh.references.size());
  bvh.stats.bytes = bvh.nodes.size() * sizeof(BvhNode) + bvh.references.size() * sizeof(std::uint32_t);
  bvh.stats.sah = sah_cost(bvh, settings);
  return bvh;
}

}  // namespace ballot
