// Tests that the eight-wide tree holds each leaf of the binary tree once.
#include <gtest/gtest.h>

#include "engine/tree/formats/wide8.h"
#include "tests/cpu/leaves_of.h"
#include "tests/cpu/shapes.h"

namespace ballot {
namespace {

struct Child {
  Bounds box;
  std::uint32_t ref;
};

std::vector<Child> children_of(const Wide8Tree& wide, std::uint32_t node) {
  std::vector<Child> all;
  for (std::uint32_t c = 0; c < WIDE8_CHILDREN; ++c) {
    const glm::uvec4 &lo = wide.nodes[node * WIDE8_NODE_TEXELS + c],
                     &hi = wide.nodes[node * WIDE8_NODE_TEXELS + WIDE8_CHILDREN + c];
    if (lo.w != END_OF_TREE) all.push_back({{as_vec3(lo), as_vec3(hi)}, lo.w});
  }
  return all;
}

struct Sizes {
  std::map<std::uint32_t, Bounds> leaves;  // by child reference
  std::uint32_t depth = 0, children = 0;
};

void walk(const Wide8Tree& wide, std::uint32_t node, std::uint32_t level, Sizes& sizes) {
  sizes.depth = std::max(sizes.depth, level);
  for (const Child& c : children_of(wide, node)) {
    ++sizes.children;
    if (!is_leaf(c.ref))
      walk(wide, c.ref, level + 1, sizes);
    else
      EXPECT_TRUE(sizes.leaves.emplace(c.ref, c.box).second) << "leaf " << c.ref << " twice";
  }
}

struct Made {
  PairTree binary;
  Wide8Tree wide;
};

Made make(const shapes::Triangles& triangles, NodeLayout layout = NodeLayout::Interleaved) {
  const Bvh bvh = build_bvh(triangles);
  Made made{encode_pairs(bvh, triangles, layout), {}};
  made.wide = encode_wide8(made.binary);
  return made;
}

TEST(FormatWide8, HoldsEveryLeafOnce) {
  for (const shapes::Triangles& triangles :
       {shapes::soup(1, 1), shapes::soup(7, 1), shapes::soup(3000, 0.1f), shapes::sphere(5), shapes::identical(300)})
    for (const NodeLayout layout : {NodeLayout::Interleaved, NodeLayout::Paper}) {
      const Made made = make(triangles, layout);
      Sizes sizes;
      walk(made.wide, 0, 1, sizes);
      const std::map<std::uint32_t, Bounds> leaves = leaves_of(made.binary);
      ASSERT_EQ(sizes.leaves.size(), leaves.size());
      for (const auto& [ref, box] : leaves) {
        ASSERT_TRUE(sizes.leaves.contains(ref));
        EXPECT_EQ(sizes.leaves[ref].lo, box.lo);
        EXPECT_EQ(sizes.leaves[ref].hi, box.hi);
      }
      EXPECT_EQ(sizes.depth, made.wide.depth);
      EXPECT_EQ(sizes.children, made.wide.children);
      EXPECT_LE(made.wide.depth, std::max(made.binary.depth, 1u));
    }
}

TEST(FormatWide8, AnEmptySceneHasNoNodes) { EXPECT_TRUE(make({}).wide.nodes.empty()); }

TEST(FormatWide8, NodesAreWellFilled) {
  const Made made = make(shapes::sphere(6));
  const double filled = double(made.wide.children) / double(made.wide.nodes.size() / WIDE8_NODE_TEXELS);
  EXPECT_GT(filled, 5.5);
}

}  // namespace
}  // namespace ballot
