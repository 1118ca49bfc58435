// Tests that the compressed eight-wide tree holds each leaf of the binary tree once, in widened boxes that are as tight
// as their grid allows, and that children lie in the slots of their side.
#include <gtest/gtest.h>

#include "engine/oracle/dyadic.h"
#include "engine/tree/formats/bvh8.h"
#include "engine/tree/host/build.h"
#include "tests/cpu/leaves_of.h"
#include "tests/cpu/pair_trees.h"
#include "tests/cpu/shapes.h"

namespace ballot {
namespace {

struct Bvh8Node {
  glm::vec3 first, step;
  std::uint32_t inner, leaves;
  std::array<glm::uvec4, 3> planes;  // of each axis: two words of lower planes, then two of upper ones

  std::uint32_t lower(int axis, int slot) const { return planes[axis][slot / 4] >> 8 * (slot % 4) & 255; }
  std::uint32_t upper(int axis, int slot) const { return planes[axis][2 + slot / 4] >> 8 * (slot % 4) & 255; }
  Dyadic plane(int axis, std::uint32_t steps) const {
    return Dyadic(first[axis]) + Dyadic(step[axis]) * Dyadic(float(steps));
  }
};

Bvh8Node node_at(const Bvh8Tree& tree, std::uint32_t number) {
  const glm::uvec4* t = tree.texels.data() + std::size_t(number) * BVH8_NODE_TEXELS;
  return {as_vec3(t[0]), as_vec3(t[1]), t[0].w, t[1].w, {t[2], t[3], t[4]}};
}

/// Expects the box of a child, or more of it than the margin of its node lets escape the grid by one step.
void expect_tight(const Bvh8Node& n, int slot, const Bounds& box, const Bounds& all) {
  for (int axis = 0; axis < 3; ++axis) {
    const std::uint32_t lower = n.lower(axis, slot), upper = n.upper(axis, slot);
    const double margin = 0x1p-20 * (double(all.hi[axis]) - all.lo[axis]);
    const Bounds wide =
        rounded_outwards(glm::dvec3(double(box.lo[axis]) - margin), glm::dvec3(double(box.hi[axis]) + margin));
    EXPECT_LE(n.plane(axis, lower), Dyadic(wide.lo.x));
    EXPECT_GE(n.plane(axis, upper), Dyadic(wide.hi.x));
    EXPECT_TRUE(lower == 255 || n.plane(axis, lower + 1) > Dyadic(wide.lo.x));
    EXPECT_TRUE(upper == 0 || n.plane(axis, upper - 1) < Dyadic(wide.hi.x));
  }
}

struct Bvh8Walk {
  const Bvh8Tree& tree;
  const std::map<std::uint32_t, Bounds>& leaves;
  std::uint32_t children = 0, depth = 0;
  std::map<std::uint32_t, int> met = {};

  /// Checks the subtree of a node. Returns the box of all leaves below it.
  Bounds visit(std::uint32_t number, std::uint32_t level) {
    const Bvh8Node n = node_at(tree, number);
    depth = std::max(depth, level);
    EXPECT_EQ(n.inner & n.leaves & 255u, 0u);
    std::array<Bounds, BVH8_CHILDREN> boxes{};
    Bounds all{glm::vec3(std::numeric_limits<float>::infinity()), glm::vec3(-std::numeric_limits<float>::infinity())};
    std::uint32_t child = n.inner >> 8, leaf = 0;
    for (int slot = 0; slot < BVH8_CHILDREN; ++slot) {
      if (!((n.inner | n.leaves) >> slot & 1)) continue;
      ++children;
      if (n.inner >> slot & 1) {
        boxes[slot] = visit(child++, level + 1);
      } else {
        const std::uint32_t ref = tree.texels[(n.leaves >> 8) + leaf / 4][int(leaf % 4)];
        ++leaf;
        ++met[ref];
        EXPECT_TRUE(leaves.contains(ref)) << ref;
        boxes[slot] = leaves.at(ref);
      }
      all = {glm::min(all.lo, boxes[slot].lo), glm::max(all.hi, boxes[slot].hi)};
    }
    for (int slot = 0; slot < BVH8_CHILDREN; ++slot)
      if ((n.inner | n.leaves) >> slot & 1) expect_tight(n, slot, boxes[slot], all);
    return all;
  }
};

TEST(FormatBvh8, HoldsEveryLeafOnceInATightBox) {
  const shapes::Triangles soup = shapes::soup(1000, 0.1f);
  const std::pair<const char*, shapes::Triangles> cases[] = {
      {"one triangle", shapes::soup(1, 1)},
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
    const Bvh8Tree tree = encode_bvh8(binary);
    const std::map<std::uint32_t, Bounds> leaves = leaves_of(binary);
    Bvh8Walk walk{tree, leaves};
    walk.visit(0, 1);
    EXPECT_EQ(walk.met.size(), leaves.size());
    for (const auto& [ref, times] : walk.met) EXPECT_EQ(times, 1) << ref;
    EXPECT_EQ(walk.children, tree.children);
    EXPECT_EQ(walk.depth, tree.depth);
    EXPECT_LE(tree.depth, std::max(binary.depth, 1u));
  }
}

TEST(FormatBvh8, AnEmptySceneHasNoNodes) {
  const Bvh8Tree tree = encode_bvh8(binary_of({}));
  EXPECT_TRUE(tree.texels.empty());
  EXPECT_EQ(tree.nodes, 0u);
}

TEST(FormatBvh8, NodesAreWellFilled) {
  const Bvh8Tree tree = encode_bvh8(binary_of(shapes::sphere(6)));
  EXPECT_GT(double(tree.children) / double(tree.nodes), 5.5);
}

// Eight triangles, one around each corner of a cube: each lies in the slot of its corner.
TEST(FormatBvh8, ChildrenLieInTheSlotOfTheirSide) {
  shapes::Triangles corners;
  for (int i = 0; i < 8; ++i) {
    const glm::vec3 at(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
    corners.push_back({10.f * at, 10.f * at + glm::vec3(0.1f, 0, 0), 10.f * at + glm::vec3(0, 0.1f, 0.1f)});
  }
  const PairTree binary =
      encode_pairs(build_bvh(corners, {.max_leaf = 1, .split_budget = 0}), corners, NodeLayout::Interleaved);
  const Bvh8Tree tree = encode_bvh8(binary);
  ASSERT_EQ(tree.nodes, 1u);
  ASSERT_EQ(tree.texels[1].w & 255u, 255u);
  for (std::uint32_t slot = 0; slot < 8; ++slot) {
    const std::uint32_t leaf = tree.texels[(tree.texels[1].w >> 8) + slot / 4][int(slot % 4)];
    EXPECT_EQ(decode_prim(binary, leaf_texel(leaf) + LEAF_HEADER_TEXELS), slot);
  }
}

}  // namespace
}  // namespace ballot
