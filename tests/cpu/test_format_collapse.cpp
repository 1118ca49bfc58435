// Tests that no other collapse of a binary tree has a smaller summed area.
#include <gtest/gtest.h>

#include "engine/core/error.h"
#include "engine/tree/formats/collapse.h"
#include "engine/tree/host/build.h"
#include "tests/cpu/leaves_of.h"
#include "tests/cpu/shapes.h"

namespace ballot {
namespace {

double area(const Bounds& b) {
  const glm::dvec3 e = glm::dvec3(b.hi) - glm::dvec3(b.lo);
  return e.x * e.y + e.y * e.z + e.z * e.x;
}

using Cut = std::vector<DeviceChild>;

// Returns every way to cut the tree below a pair of siblings into at most `width` subtrees.
std::vector<Cut> cuts_below(const PairTree& bvh, std::uint32_t pair_at, std::size_t width) {
  const DevicePair pair = decode_pair(bvh, pair_at);
  const auto cuts_of = [&](const DeviceChild& child) {
    std::vector<Cut> cuts = is_leaf(child.ref) ? std::vector<Cut>() : cuts_below(bvh, child.ref, width);
    cuts.push_back({child});
    return cuts;
  };
  std::vector<Cut> all;
  const std::vector<Cut> rights = cuts_of(pair.right);
  for (const Cut& left : cuts_of(pair.left))
    for (const Cut& right : rights) {
      if (left.size() + right.size() > width) continue;
      all.push_back(left);
      all.back().insert(all.back().end(), right.begin(), right.end());
    }
  return all;
}

double least_area(const PairTree& bvh, const DeviceChild& subtree, std::size_t width) {
  if (is_leaf(subtree.ref)) return 0;
  double best = std::numeric_limits<double>::infinity();
  for (const Cut& cut : cuts_below(bvh, subtree.ref, width)) {
    double sum = 0;
    for (const DeviceChild& child : cut) sum += least_area(bvh, child, width);
    best = std::min(best, sum);
  }
  return best + area(subtree.box);
}

// Returns the summed area of all nodes.
double area(const CollapsedBvh& tree) {
  double sum = 0;
  for (std::size_t node = 0; node < tree.ends.size(); ++node) {
    Bounds box{glm::vec3(1e38f), glm::vec3(-1e38f)};
    for (const DeviceChild& c : tree.children_of(node)) box = {glm::min(box.lo, c.box.lo), glm::max(box.hi, c.box.hi)};
    sum += area(box);
  }
  return sum;
}

TEST(FormatCollapse, NoOtherHasLessArea) {
  for (const int width : {2, 3, 4, 8})
    for (const int count : {2, 9, 12, 15}) {
      const shapes::Triangles triangles = shapes::soup(std::size_t(count), 0.2f);
      const Bvh bvh = build_bvh(triangles, {.max_leaf = 1, .split_budget = 0});
      const PairTree binary = encode_pairs(bvh, triangles, NodeLayout::Interleaved);
      const double best = least_area(binary, {binary.root_box, binary.root}, std::size_t(width));
      EXPECT_NEAR(area(collapse(binary, width, 1000)), best, 1e-5 * best) << count << " triangles, width " << width;
    }
}

TEST(FormatCollapse, ParentsComeBeforeChildrenAndNodesAreNumbered) {
  const shapes::Triangles triangles = shapes::soup(3000, 0.1f);
  const PairTree binary = encode_pairs(build_bvh(triangles), triangles, NodeLayout::Interleaved);
  for (const int width : {2, 4, 8}) {
    const CollapsedBvh tree = collapse(binary, width, 10000);
    std::vector<int> met(tree.ends.size());
    for (std::size_t node = 0; node < tree.ends.size(); ++node) {
      EXPECT_GE(tree.children_of(node).size(), 2u);
      EXPECT_LE(tree.children_of(node).size(), std::size_t(width));
      for (const DeviceChild& c : tree.children_of(node)) {
        if (is_leaf(c.ref)) continue;
        ASSERT_LT(c.ref, tree.ends.size());
        EXPECT_GT(c.ref, node);
        ++met[c.ref];
      }
    }
    EXPECT_EQ(met[0], 0);
    for (std::size_t node = 1; node < met.size(); ++node) EXPECT_EQ(met[node], 1) << node;
    EXPECT_LE(tree.depth, binary.depth);
  }
}

// Areas may leave the range of float32 where coordinates do not.
TEST(FormatCollapse, ScenesOfAllSizesCollapseAlike) {
  const shapes::Triangles near = shapes::soup(500, 0.1f);
  const Bvh bvh = build_bvh(near);
  for (const int width : {4, 8}) {
    const CollapsedBvh tree = collapse(encode_pairs(bvh, near, NodeLayout::Interleaved), width, 10000);
    for (const float scale : {0x1p-60f, 0x1p+70f, 0x1p+120f}) {
      Bvh scaled = bvh;
      for (BvhNode& node : scaled.nodes) node.lo *= scale, node.hi *= scale;
      scaled.bounds = {bvh.bounds.lo * scale, bvh.bounds.hi * scale};
      const shapes::Triangles triangles = shapes::scaled(near, scale);
      const CollapsedBvh other = collapse(encode_pairs(scaled, triangles, NodeLayout::Interleaved), width, 10000);
      ASSERT_EQ(other.ends, tree.ends) << scale;
      for (std::size_t i = 0; i < tree.children.size(); ++i)
        ASSERT_EQ(other.children[i].ref, tree.children[i].ref) << scale;
    }
  }
}

TEST(FormatCollapse, RefusesMoreNodesThanReferencesCanNumber) {
  const shapes::Triangles triangles = shapes::soup(300, 0.1f);
  const PairTree binary = encode_pairs(build_bvh(triangles), triangles, NodeLayout::Interleaved);
  try {
    collapse(binary, 4, 5);
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("4 children per node has more than 5 nodes"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace ballot
