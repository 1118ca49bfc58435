// Tests of padded boxes (engine/tree/host/padding.h).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/tree/formats/pair_decode.h"
#include "engine/tree/host/padding.h"
#include "tests/cpu/shapes.h"

namespace ballot {
namespace {

/// Returns the padding of a node's box along an axis, on the side where it is smaller.
double margin(const Bvh& bvh, const std::vector<Bounds>& boxes, std::size_t i, int axis) {
  const double origin = box_origin(bvh.bounds)[axis];
  const double lo = bvh.nodes[i].lo[axis] - origin, hi = bvh.nodes[i].hi[axis] - origin;
  return std::min(lo - double(boxes[i].lo[axis]), double(boxes[i].hi[axis]) - hi);
}

TEST(BvhPadding, LeavesGoByTheirTrianglesAndCoordinates) {
  constexpr double w = 0x1p-24;
  for (const shapes::Triangles& triangles : {shapes::soup(2000, 0.1f), shapes::huge_and_tiny(500), shapes::sphere(4),
                                             shapes::moved(shapes::soup(500, 0.5f), {4e5f, -5e6f, 0.3f})}) {
    const Bvh bvh = build_bvh(triangles);
    const glm::dvec3 origin = box_origin(bvh.bounds);
    const std::vector<Bounds> boxes = padded_boxes(bvh, triangles);
    ASSERT_EQ(boxes.size(), bvh.nodes.size());
    for (std::size_t i = 0; i < bvh.nodes.size(); ++i) {
      const BvhNode& node = bvh.nodes[i];
      for (std::uint32_t k = 0; k < node.count; ++k) {
        const Triangle& t = triangles[bvh.references[node.first + k]];
        const glm::dvec3 side =
            glm::dvec3(glm::max(t[0], glm::max(t[1], t[2]))) - glm::dvec3(glm::min(t[0], glm::min(t[1], t[2])));
        const double longest = std::max({side.x, side.y, side.z});
        for (int axis = 0; axis < 3; ++axis) {
          const double lo = node.lo[axis] - origin[axis], hi = node.hi[axis] - origin[axis];
          const double moved = origin[axis] != 0 ? 0.5 * (std::abs(lo + hi) + hi - lo) : 0;
          const double needed = w * (18 * side[axis] + 31 * longest + std::abs(lo + hi) + 1.5 * (hi - lo) + moved);
          ASSERT_GE(margin(bvh, boxes, i, axis), needed) << "leaf " << i << ", axis " << axis;
        }
      }
    }
  }
}

TEST(BvhPadding, InnerBoxesNeedWhatLiesBelow) {
  const shapes::Triangles triangles = shapes::huge_and_tiny(500);
  const Bvh bvh = build_bvh(triangles);
  const std::vector<Bounds> boxes = padded_boxes(bvh, triangles);
  for (std::size_t i = 0; i < bvh.nodes.size(); ++i) {
    if (bvh.nodes[i].count || i == 1) continue;
    for (const std::size_t child : {bvh.nodes[i].first, bvh.nodes[i].first + 1})
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_LE(boxes[i].lo[axis], boxes[child].lo[axis]) << "node " << i << ", axis " << axis;
        EXPECT_GE(boxes[i].hi[axis], boxes[child].hi[axis]) << "node " << i << ", axis " << axis;
      }
  }
}

// A small triangle far from a large one is padded as if it were alone, but for the padding that clamped directions
// need.
TEST(BvhPadding, ALargeTriangleDoesNotWidenTheOthers) {
  shapes::Triangles triangles = shapes::soup(400, 0.01f);
  triangles.push_back({{{-100, -100, -100}, {100, -100, -100}, {-100, 100, -100}}});
  const Bvh bvh = build_bvh(triangles);
  const std::vector<Bounds> boxes = padded_boxes(bvh, triangles);
  for (std::size_t i = 0; i < bvh.nodes.size(); ++i)
    if (bvh.nodes[i].count && bvh.nodes[i].lo.z > -50) {
      EXPECT_LT(margin(bvh, boxes, i, 0), 1e-5 / 4) << i;
    }
}

TEST(BvhPadding, EveryLayoutHoldsTheBoxes) {
  const shapes::Triangles triangles = shapes::soup(1000, 0.2f);
  const Bvh bvh = build_bvh(triangles);
  const std::vector<Bounds> boxes = padded_boxes(bvh, triangles);
  for (const NodeLayout layout :
       {NodeLayout::Paper, NodeLayout::Interleaved, NodeLayout::Centred, NodeLayout::Compact}) {
    const PairTree device = encode_pairs(bvh, triangles, layout, boxes);
    const PairTree plain = encode_pairs(bvh, triangles, layout);
    EXPECT_EQ(device.leaves, plain.leaves);
    EXPECT_EQ(device.root, plain.root);
    for (std::uint32_t i = 2; i < bvh.nodes.size(); i += 2) {
      const DevicePair pair = decode_pair(device, (i / 2 - 1) * device.pair_texels());
      for (const auto& [box, child] : {std::pair(boxes[i], pair.left), std::pair(boxes[i + 1], pair.right)}) {
        EXPECT_TRUE(glm::all(glm::lessThanEqual(child.box.lo, box.lo + 1e-6f)));
        EXPECT_TRUE(glm::all(glm::greaterThanEqual(child.box.hi, box.hi - 1e-6f)));
      }
    }
  }
}

TEST(BvhPadding, NumbersThatFloatsDoNotCarryAreLeftToRays) {
  const auto cube = [](float at, float side) { return Bounds{glm::vec3(at), glm::vec3(at + side)}; };
  EXPECT_EQ(padded_reach(cube(0, 2)), 0x1p+22f);
  EXPECT_GT(padded_reach(cube(1e6f, 1)), 0);
  EXPECT_EQ(padded_reach(cube(0, 1e14f)), 0);
  EXPECT_EQ(padded_reach(cube(0, 1e-19f)), 0);
  EXPECT_EQ(padded_reach(cube(1e19f, 1e13f)), 0);
  EXPECT_EQ(padded_reach(Bounds{}), 0);
}

}  // namespace
}  // namespace ballot
