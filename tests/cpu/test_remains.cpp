// Tests that a tree and its triangles come back from what the host keeps of them and the leaf blocks of the device.
#include "engine/tree/formats/remains.h"

#include <gtest/gtest.h>

#include <cstring>

#include "engine/tree/formats/pair.h"
#include "engine/tree/host/refit.h"
#include "tests/cpu/shapes.h"

namespace ballot {
namespace {

using shapes::Triangles;

/// Wipes a tree and its triangles but for the sizes, restores them, and expects them to be as they were.
void expect_back(const Bvh& bvh, const Triangles& triangles) {
  const PairTree device = encode_pairs(bvh, triangles, NodeLayout::Interleaved);
  const TreeRemains remains = remains_of(bvh, triangles);
  EXPECT_EQ(remains.left_out.size(), bvh.stats.degenerate);
  Bvh again = bvh;
  Triangles corners(triangles.size());
  std::ranges::fill(again.nodes, BvhNode{});
  std::ranges::fill(again.references, 0u);
  restore(remains, device.leaves, again, corners);
  EXPECT_TRUE(corners == triangles);
  ASSERT_EQ(again.nodes.size(), bvh.nodes.size());
  for (std::size_t i = 0; i < bvh.nodes.size(); ++i) {
    const BvhNode &a = again.nodes[i], &b = bvh.nodes[i];
    ASSERT_TRUE(i == 1 || (a.lo == b.lo && a.hi == b.hi)) << "node " << i;
    ASSERT_EQ(a.count, b.count) << "node " << i;
    ASSERT_TRUE(a.count > 0 || a.first == b.first) << "node " << i;
  }
  for (const NodeLayout layout : {NodeLayout::Interleaved, NodeLayout::Compact}) {
    const PairTree before = encode_pairs(bvh, triangles, layout), after = encode_pairs(again, corners, layout);
    EXPECT_TRUE(before.nodes == after.nodes);
    EXPECT_TRUE(before.leaves == after.leaves);
  }
}

TEST(Remains, BringBackTreesOfEveryBuilder) {
  const Triangles flat = {{glm::vec3(1), glm::vec3(2), glm::vec3(3)}, {glm::vec3(5), glm::vec3(5), glm::vec3(6)}};
  Triangles far = shapes::soup(3000, 0.2f);
  for (Triangle& t : far)
    for (glm::vec3& v : t) v += glm::vec3(500000, 0, -4000000);
  const Triangles scenes[] = {shapes::soup(40000, 0.1f),
                              far,
                              shapes::slivers(2000),
                              shapes::huge_and_tiny(1000),
                              shapes::joined(shapes::joined(flat, shapes::sphere(3)), flat),
                              shapes::identical(7),
                              {shapes::soup(1, 1)[0]}};
  for (const Triangles& triangles : scenes)
    for (const BuilderId builder : {BuilderId::Best, BuilderId::Balanced, BuilderId::Fast}) {
      SCOPED_TRACE(fmt::format("{} triangles, {}", triangles.size(), builder_of(builder).name));
      Bvh bvh = build_bvh(triangles, {.builder = builder});
      expect_back(bvh, triangles);
      if (bvh.stats.references + bvh.stats.degenerate != bvh.stats.triangles) continue;
      Triangles moved = triangles;
      for (Triangle& t : moved)
        for (glm::vec3& v : t) v *= 1.25f;
      refit_bvh(bvh, moved, {.builder = builder});
      expect_back(bvh, moved);
    }
}

TEST(Remains, AreNothingOfAnEmptyTree) { expect_back(build_bvh({}), {}); }

}  // namespace
}  // namespace ballot
