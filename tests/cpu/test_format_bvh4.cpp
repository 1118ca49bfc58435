// Tests that the four-wide tree holds each leaf of the binary tree once, in boxes that are as tight as their grid
// allows.
#include <gtest/gtest.h>

#include "engine/oracle/dyadic.h"
#include "engine/tree/formats/bvh4.h"
#include "engine/tree/host/build.h"
#include "tests/cpu/leaves_of.h"
#include "tests/cpu/pair_trees.h"
#include "tests/cpu/shapes.h"

namespace ballot {
namespace {

struct Node {
  glm::vec3 first, step;
  glm::uvec3 lower, upper;  // one byte per child
  glm::uvec4 child;
};

Node node_at(const Bvh4Tree& tree, std::uint32_t texel) {
  const glm::uvec4* t = tree.nodes.data() + texel;
  return {
      as_vec3(t[0]), {as_float(t[0].w), as_float(t[1].w), as_float(t[2].w)}, glm::uvec3(t[1]), glm::uvec3(t[2]), t[3]};
}

Dyadic plane(const Node& n, int axis, std::uint32_t steps) {
  return Dyadic(n.first[axis]) + Dyadic(n.step[axis]) * Dyadic(float(steps));
}

void expect_tight(const Node& n, int child, const Bounds& box) {
  for (int axis = 0; axis < 3; ++axis) {
    const std::uint32_t lower = n.lower[axis] >> 8 * child & 255, upper = n.upper[axis] >> 8 * child & 255;
    const Dyadic lo(box.lo[axis]), hi(box.hi[axis]);
    EXPECT_LE(plane(n, axis, lower), lo);
    EXPECT_GE(plane(n, axis, upper), hi);
    EXPECT_TRUE(lower == 255 || plane(n, axis, lower + 1) > lo);
    EXPECT_TRUE(upper == 0 || plane(n, axis, upper - 1) < hi);
  }
}

struct Walk {
  const Bvh4Tree& tree;
  const std::map<std::uint32_t, Bounds>& leaves;
  std::uint32_t children = 0, depth = 0;
  std::map<std::uint32_t, int> met = {};

  /// Checks the subtree of a node. Returns the box of all leaves below it.
  Bounds visit(std::uint32_t texel, std::uint32_t level) {
    const Node n = node_at(tree, texel);
    Bounds all{glm::vec3(std::numeric_limits<float>::infinity()), glm::vec3(-std::numeric_limits<float>::infinity())};
    depth = std::max(depth, level);
    for (int c = 0; c < BVH4_CHILDREN; ++c) {
      const std::uint32_t ref = n.child[c];
      if (ref == END_OF_TREE) {
        for (int axis = 0; axis < 3; ++axis)
          EXPECT_GT(n.lower[axis] >> 8 * c & 255, n.upper[axis] >> 8 * c & 255)
              << "an empty slot has a box that is not empty";
        continue;
      }
      ++children;
      if (is_leaf(ref)) {
        ++met[ref];
        EXPECT_TRUE(leaves.contains(ref));
      }
      const Bounds box = is_leaf(ref) ? leaves.at(ref) : visit(ref, level + 1);
      expect_tight(n, c, box);
      all = {glm::min(all.lo, box.lo), glm::max(all.hi, box.hi)};
    }
    return all;
  }
};

TEST(FormatBvh4, HoldsEveryLeafOnceInATightBox) {
  const shapes::Triangles soup = shapes::soup(1000, 0.1f);
  const std::pair<const char*, shapes::Triangles> cases[] = {
      {"seven triangles", shapes::soup(7, 1)},
      {"soup", soup},
      {"sphere", shapes::sphere(4)},
      {"one plane", scaled(soup, {1, 0, 1}, {0, 0.3f, 0})},
      {"far away", scaled(soup, glm::vec3(1), glm::vec3(1e6f, -3e5f, 7))},
      {"tiny", scaled(soup, glm::vec3(0x1p-130f))},
      {"flat", scaled(soup, {1, 0x1p-100f, 0x1p30f})},
      {"huge", scaled(soup, glm::vec3(5e11f))},
  };
  for (const auto& [name, triangles] : cases) {
    SCOPED_TRACE(name);
    const PairTree binary = binary_of(triangles);
    const Bvh4Tree tree = encode_bvh4(binary);
    const std::map<std::uint32_t, Bounds> leaves = leaves_of(binary);
    ASSERT_EQ(tree.root, 0u);
    ASSERT_EQ(tree.nodes.size() % BVH4_NODE_TEXELS, 0u);
    Walk walk{tree, leaves};
    walk.visit(0, 1);
    EXPECT_EQ(walk.met.size(), leaves.size());
    for (const auto& [ref, times] : walk.met) EXPECT_EQ(times, 1) << ref;
    EXPECT_EQ(walk.children, tree.children);
    EXPECT_EQ(walk.depth, tree.depth);
    EXPECT_LE(tree.depth, binary.depth);
  }
}

TEST(FormatBvh4, ASceneOfOneLeafOrNoneHasNoNodes) {
  for (const std::size_t count : {0u, 1u}) {
    const PairTree binary = binary_of(shapes::soup(count, 1));
    const Bvh4Tree tree = encode_bvh4(binary);
    EXPECT_TRUE(tree.nodes.empty());
    EXPECT_EQ(tree.root, binary.root);
    EXPECT_EQ(tree.depth, 0u);
  }
}

TEST(FormatBvh4, NodesAreWellFilled) {
  const Bvh4Tree tree = encode_bvh4(binary_of(shapes::sphere(6)));
  EXPECT_GT(double(tree.children) / double(tree.nodes.size() / BVH4_NODE_TEXELS), 3.2);
}

}  // namespace
}  // namespace ballot
