// Tests that the uploaded arrays hold the reference form, in every layout.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/tree/formats/pair_decode.h"
#include "tests/cpu/shapes.h"

namespace ballot {

static std::string layout_name(NodeLayout layout) {
  constexpr const char* names[] = {"paper", "interleaved", "centred", "compact"};
  return names[int(layout)];
}
void PrintTo(NodeLayout layout, std::ostream* out) { *out << layout_name(layout); }

namespace {

class BvhDevice : public testing::TestWithParam<NodeLayout> {
 protected:
  // Follows both forms from the root and compares every box and every triangle.
  static void expect_same(const Bvh& bvh, const PairTree& device, const UnsetVector<Triangle>& triangles) {
    struct Step {
      std::uint32_t node, ref;
    };
    std::size_t visited = 0;
    std::vector<Step> todo{{0, device.root}};
    while (!todo.empty()) {
      const Step at = todo.back();
      todo.pop_back();
      ++visited;
      const BvhNode& node = bvh.nodes[at.node];
      ASSERT_EQ(is_leaf(at.ref), node.count > 0);
      if (is_leaf(at.ref)) {
        expect_leaf(node, at.ref, bvh, device, triangles);
        continue;
      }
      ASSERT_EQ(at.ref % device.pair_texels(), 0u);
      const DevicePair pair = decode_pair(device, at.ref);
      expect_box(pair.left, bvh.nodes[node.first], device.origin);
      expect_box(pair.right, bvh.nodes[node.first + 1], device.origin);
      todo.push_back({node.first, pair.left.ref});
      todo.push_back({node.first + 1, pair.right.ref});
    }
    EXPECT_EQ(visited, bvh.stats.nodes);
  }

  /// Returns by how much a box may grow in a layout that stores centres, as a share of its half extent. A box without
  /// extent may grow by a denormal number.
  static float slack() {
    return GetParam() == NodeLayout::Compact ? 0x1p-7f : GetParam() == NodeLayout::Centred ? 0x1p-22f : 0;
  }

  static void expect_box(const DeviceChild& child, const BvhNode& node, const glm::vec3& origin) {
    for (int axis = 0; axis < 3; ++axis) {
      const float lo = node.lo[axis] - origin[axis], hi = node.hi[axis] - origin[axis];
      const float most =
          slack() * (hi - lo) + (slack() > 0 ? 0x1p-22f * std::max(std::abs(lo), std::abs(hi)) + 0x1p-126f : 0);
      ASSERT_LE(child.box.lo[axis], lo);
      ASSERT_GE(child.box.hi[axis], hi);
      ASSERT_LE(lo - child.box.lo[axis], most);
      ASSERT_LE(child.box.hi[axis] - hi, most);
    }
  }

  static void expect_leaf(const BvhNode& node, std::uint32_t ref, const Bvh& bvh, const PairTree& device,
                          const UnsetVector<Triangle>& triangles) {
    ASSERT_EQ(leaf_count(ref), node.count);
    std::uint32_t texel = leaf_texel(ref);
    ASSERT_EQ(device.leaves[texel].w, node.count);
    ASSERT_EQ(as_vec3(device.leaves[texel]), node.lo - device.origin);
    ASSERT_EQ(as_vec3(device.leaves[texel + 1]), node.hi - device.origin);
    texel += LEAF_HEADER_TEXELS;
    for (std::uint32_t i = 0; i < node.count; ++i, texel += TRIANGLE_TEXELS) {
      const std::uint32_t prim = bvh.references[node.first + i];
      ASSERT_EQ(decode_prim(device, texel), prim);
      ASSERT_EQ(decode_triangle(device, texel), triangles[prim]);
      for (std::uint32_t axis = 0; axis < 3; ++axis) ASSERT_EQ(device.leaves[texel + axis].w, prim);
    }
  }
};

TEST_P(BvhDevice, HoldsTheReferenceForm) {
  for (const auto& triangles :
       {shapes::identical(1), shapes::identical(6), shapes::identical(7), shapes::soup(500, 0.3f), shapes::slivers(300),
        shapes::grid(20), shapes::moved(shapes::soup(500, 0.5f), {4e5f, -5e6f, 0.3f})}) {
    const Bvh bvh = build_bvh(triangles);
    const PairTree device = encode_pairs(bvh, triangles, GetParam());
    EXPECT_EQ(device.layout, GetParam());
    EXPECT_EQ(device.depth, bvh.stats.depth);
    EXPECT_EQ(device.nodes.size(), (bvh.nodes.size() / 2 - 1) * device.pair_texels());
    EXPECT_EQ(device.leaves.size(), bvh.stats.leaves * LEAF_HEADER_TEXELS + bvh.references.size() * TRIANGLE_TEXELS);
    EXPECT_EQ(device.bounds.hi, bvh.bounds.hi);
    EXPECT_EQ(device.origin, box_origin(bvh.bounds));
    EXPECT_EQ(device.root_box.lo, bvh.bounds.lo - device.origin);
    EXPECT_EQ(device.root_box.hi, bvh.bounds.hi - device.origin);
    EXPECT_EQ(device.root == 0, bvh.stats.leaves > 1);
    expect_same(bvh, device, triangles);
  }
}

// Large trees are encoded in chunks, also into the memory of other trees.
TEST_P(BvhDevice, HoldsLargeTreesToo) {
  const auto few = shapes::soup(30, 0.3f), many = shapes::soup(40'000, 0.02f);
  const Bvh small = build_bvh(few), large = build_bvh(many, {.builder = BuilderId::Fast});
  PairTree device = encode_pairs(large, many, GetParam());
  expect_same(large, device, many);
  device = encode_pairs(small, few, GetParam(), {}, std::move(device));
  expect_same(small, device, few);
  device = encode_pairs(large, many, GetParam(), {}, std::move(device));
  expect_same(large, device, many);
  device = encode_pairs({}, {}, GetParam(), {}, std::move(device));
  EXPECT_TRUE(device.nodes.empty() && device.leaves.empty());
  EXPECT_EQ(device.root, END_OF_TREE);
}

TEST_P(BvhDevice, EmptySceneIsEmpty) {
  const PairTree device = encode_pairs(build_bvh({}), {}, GetParam());
  EXPECT_EQ(device.root, END_OF_TREE);
  EXPECT_TRUE(device.nodes.empty());
  EXPECT_TRUE(device.leaves.empty());
}

INSTANTIATE_TEST_SUITE_P(Layouts, BvhDevice,
                         testing::Values(NodeLayout::Paper, NodeLayout::Interleaved, NodeLayout::Centred,
                                         NodeLayout::Compact),
                         [](const auto& tested) { return layout_name(tested.param); });

TEST(FormatPairOrigin, IsWhereDifferencesAreExact) {
  const auto along_x = [](float lo, float hi) { return box_origin({{lo, 0, 0}, {hi, 0, 0}}).x; };
  EXPECT_EQ(along_x(-1, 1), 0);
  EXPECT_EQ(along_x(15, 16), 0);
  EXPECT_EQ(along_x(16, 17), 16.5f);
  EXPECT_EQ(along_x(-17, -16), -16.5f);
  EXPECT_EQ(along_x(7, 7), 7);
  EXPECT_FLOAT_EQ(along_x(3.3e38f, 3.4e38f), 3.35e38f);
  EXPECT_EQ(box_origin(Bounds{}), glm::vec3(0));
  EXPECT_EQ(box_origin({{16, 1, -1}, {17, 3, 1}}), glm::vec3(0));
  EXPECT_EQ(box_origin({{160, 1, -1}, {161, 3, 1}}), glm::vec3(160.5f, 0, 0));
  for (const float lo : {448000.f, 5.41178e6f, 3e-37f, 16777213.f})
    for (float hi = lo; hi <= 1.06f * lo; hi += 0.013f * lo) {
      const float origin = along_x(lo, hi);
      for (const float x : {lo, std::nextafter(lo, hi), 0.3f * lo + 0.7f * hi, hi})
        EXPECT_EQ(double(x - origin), double(x) - double(origin)) << x << " in [" << lo << ", " << hi << "]";
    }
}

// Near 5.4e6 neighbouring floats are half a unit apart. Boxes there must not grow.
TEST(FormatPairOrigin, KeepsBoxesFarFromZeroSmall) {
  const shapes::Triangles near = shapes::grid(30);
  const shapes::Triangles far = shapes::moved(shapes::scaled(near, 1024), {448000, 0, 5411000});
  const Bvh bvh = build_bvh(far);
  for (const NodeLayout layout : {NodeLayout::Centred, NodeLayout::Compact}) {
    const PairTree device = encode_pairs(bvh, far, layout);
    const DevicePair pair = decode_pair(device, device.root);
    const glm::vec3 own = bvh.nodes[2].hi - bvh.nodes[2].lo, kept = pair.left.box.hi - pair.left.box.lo;
    for (int axis = 0; axis < 3; ++axis) EXPECT_LE(kept[axis], own[axis] * 1.01f + 1e-3f) << "axis " << axis;
    const DevicePair world = decode_pair_from_zero(device, device.root);
    EXPECT_TRUE(glm::all(glm::lessThanEqual(world.left.box.lo, bvh.nodes[2].lo)));
    EXPECT_TRUE(glm::all(glm::greaterThanEqual(world.left.box.hi, bvh.nodes[2].hi)));
  }
}

TEST(FormatPairSize, TooManyLeafTexelsAreRefused) {
  Bvh bvh = build_bvh(shapes::identical(1));
  bvh.stats.leaves = 1u << 28;
  EXPECT_ANY_THROW(encode_pairs(bvh, shapes::identical(1), NodeLayout::Paper));
}

}  // namespace
}  // namespace ballot
