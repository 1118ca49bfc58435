// The uploaded arrays hold the reference form, in every layout.
#include <gtest/gtest.h>

#include "engine/bvh/device_decode.h"
#include "tests/cpu/shapes.h"

namespace ballot {
namespace {

class BvhDevice : public testing::TestWithParam<NodeLayout> {
 protected:
  // Follows both forms from the root and compares every box and every triangle.
  static void expect_same(const Bvh& bvh, const DeviceBvh& device, const std::vector<Triangle>& triangles) {
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
      expect_box(pair.left, bvh.nodes[node.first]);
      expect_box(pair.right, bvh.nodes[node.first + 1]);
      todo.push_back({node.first, pair.left.ref});
      todo.push_back({node.first + 1, pair.right.ref});
    }
    EXPECT_EQ(visited, bvh.stats.nodes);
  }

  /// Layouts by centres may hold a box that is larger, by so much of its half extent.
  static float slack() {
    return GetParam() == NodeLayout::Compact ? 0x1p-7f : GetParam() == NodeLayout::Centred ? 0x1p-22f : 0;
  }

  static void expect_box(const DeviceChild& child, const BvhNode& node) {
    for (int axis = 0; axis < 3; ++axis) {
      const float lo = node.lo[axis], hi = node.hi[axis];
      const float most = slack() * (hi - lo) + (slack() > 0 ? 0x1p-22f * std::max(std::abs(lo), std::abs(hi)) : 0);
      ASSERT_LE(child.box.lo[axis], lo);
      ASSERT_GE(child.box.hi[axis], hi);
      ASSERT_LE(lo - child.box.lo[axis], most);
      ASSERT_LE(child.box.hi[axis] - hi, most);
    }
  }

  static void expect_leaf(const BvhNode& node, std::uint32_t ref, const Bvh& bvh, const DeviceBvh& device,
                          const std::vector<Triangle>& triangles) {
    ASSERT_EQ(leaf_count(ref), node.count);
    std::uint32_t texel = leaf_texel(ref);
    ASSERT_EQ(device.leaves[texel].w, node.count);
    ASSERT_EQ(as_vec3(device.leaves[texel]), node.lo);
    ASSERT_EQ(as_vec3(device.leaves[texel + 1]), node.hi);
    texel += LEAF_HEADER_TEXELS;
    for (std::uint32_t i = 0; i < node.count; ++i, texel += TRIANGLE_TEXELS) {
      const std::uint32_t prim = bvh.references[node.first + i];
      ASSERT_EQ(decode_prim(device, texel), prim);
      ASSERT_EQ(decode_triangle(device, texel), triangles[prim]);
    }
  }
};

TEST_P(BvhDevice, HoldsTheReferenceForm) {
  for (const auto& triangles : {shapes::identical(1), shapes::identical(6), shapes::identical(7),
                                shapes::soup(500, 0.3f), shapes::slivers(300), shapes::grid(20)}) {
    const Bvh bvh = build_bvh(triangles);
    const DeviceBvh device = make_device_bvh(bvh, triangles, GetParam());
    EXPECT_EQ(device.layout, GetParam());
    EXPECT_EQ(device.depth, bvh.stats.depth);
    EXPECT_EQ(device.nodes.size(), (bvh.nodes.size() / 2 - 1) * device.pair_texels());
    EXPECT_EQ(device.leaves.size(), bvh.stats.leaves * LEAF_HEADER_TEXELS + bvh.references.size() * TRIANGLE_TEXELS);
    EXPECT_EQ(device.bounds.hi, bvh.bounds.hi);
    EXPECT_EQ(device.root == 0, bvh.stats.leaves > 1);
    expect_same(bvh, device, triangles);
  }
}

TEST_P(BvhDevice, EmptySceneIsEmpty) {
  const DeviceBvh device = make_device_bvh(build_bvh({}), {}, GetParam());
  EXPECT_EQ(device.root, END_OF_TREE);
  EXPECT_TRUE(device.nodes.empty());
  EXPECT_TRUE(device.leaves.empty());
}

std::string layout_name(NodeLayout layout) {
  constexpr const char* names[] = {"paper", "interleaved", "centred", "compact"};
  return names[int(layout)];
}

INSTANTIATE_TEST_SUITE_P(Layouts, BvhDevice,
                         testing::Values(NodeLayout::Paper, NodeLayout::Interleaved, NodeLayout::Centred,
                                         NodeLayout::Compact),
                         [](const auto& tested) { return layout_name(tested.param); });

TEST(BvhDeviceSize, TooManyLeafTexelsAreRefused) {
  Bvh bvh = build_bvh(shapes::identical(1));
  bvh.stats.leaves = 1u << 28;
  EXPECT_ANY_THROW(make_device_bvh(bvh, shapes::identical(1), NodeLayout::Paper));
}

}  // namespace
}  // namespace ballot
