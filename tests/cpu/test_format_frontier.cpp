// Tests that the subtrees of the frontier hold every leaf once, in the order of each octant, and that the frontier is
// the one that opening the largest nodes gives.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "engine/tree/formats/frontier.h"
#include "engine/tree/formats/pair_decode.h"
#include "tests/cpu/shapes.h"

namespace ballot {
namespace {

using Line = std::vector<DeviceChild>;

PairTree make_device(const shapes::Triangles& triangles) {
  return encode_pairs(build_bvh(triangles), triangles, NodeLayout::Interleaved);
}

/// Returns the nodes of an octant's list. Expects that the empty ones all come at its end.
Line line_of(const std::vector<glm::uvec4>& frontier, std::uint32_t nodes, std::uint32_t octant) {
  Line line;
  bool ended = false;
  for (std::uint32_t i = 0; i < nodes; ++i) {
    const glm::uvec4 &lo = frontier[2 * (octant * nodes + i)], &hi = frontier[2 * (octant * nodes + i) + 1];
    ended |= lo.w == END_OF_TREE;
    EXPECT_EQ(ended, lo.w == END_OF_TREE) << "place " << i;
    if (!ended) line.push_back({{as_vec3(lo), as_vec3(hi)}, lo.w});
  }
  return line;
}

void leaves_below(const PairTree& bvh, std::uint32_t ref, std::vector<std::uint32_t>& out) {
  if (is_leaf(ref)) {
    out.push_back(ref);
    return;
  }
  const DevicePair pair = decode_pair(bvh, ref);
  leaves_below(bvh, pair.left.ref, out);
  leaves_below(bvh, pair.right.ref, out);
}

std::vector<std::uint32_t> leaves_of(const PairTree& bvh, const Line& line) {
  std::vector<std::uint32_t> all;
  for (const DeviceChild& c : line) leaves_below(bvh, c.ref, all);
  std::ranges::sort(all);
  return all;
}

TEST(FormatFrontier, HoldsEveryLeafOnceInEveryOctant) {
  for (const shapes::Triangles& triangles :
       {shapes::soup(1, 1), shapes::soup(40, 1), shapes::soup(3000, 0.1f), shapes::sphere(5), shapes::identical(300)})
    for (const std::uint32_t nodes : {32u, 64u}) {
      const PairTree bvh = make_device(triangles);
      const auto frontier = encode_frontier(bvh, nodes);
      ASSERT_EQ(frontier.size(), std::size_t{2} * FRONTIER_OCTANTS * nodes);
      const auto all = leaves_of(bvh, {{bvh.root_box, bvh.root}});
      for (std::uint32_t octant = 0; octant < FRONTIER_OCTANTS; ++octant) {
        const Line line = line_of(frontier, nodes, octant);
        EXPECT_EQ(line.size(), std::min<std::size_t>(nodes, all.size()));
        EXPECT_EQ(leaves_of(bvh, line), all) << "octant " << octant;
      }
    }
}

TEST(FormatFrontier, NoNodeOnItIsLargerThanOneAboveIt) {
  const PairTree bvh = make_device(shapes::soup(3000, 0.1f));
  const auto area = [](const Bounds& b) {
    const glm::dvec3 e = glm::dvec3(b.hi) - glm::dvec3(b.lo);
    return e.x * e.y + e.y * e.z + e.z * e.x;
  };
  double largest = 0;
  std::set<std::uint32_t> on_line;
  for (const DeviceChild& c : line_of(encode_frontier(bvh, 32), 32, 0)) {
    on_line.insert(c.ref);
    if (!is_leaf(c.ref)) largest = std::max(largest, area(c.box));
  }
  Line above{{bvh.root_box, bvh.root}};
  std::size_t opened = 0;
  while (!above.empty()) {
    const DeviceChild c = above.back();
    above.pop_back();
    if (on_line.contains(c.ref)) continue;
    EXPECT_GE(area(c.box), largest);
    ++opened;
    const DevicePair pair = decode_pair(bvh, c.ref);
    above.push_back(pair.left);
    above.push_back(pair.right);
  }
  EXPECT_EQ(opened, 31u);
}

// Slabs one after the other along x. Rays in direction -x meet them in the reverse order, whatever their y and z.
TEST(FormatFrontier, OrderFollowsTheOctant) {
  shapes::Triangles triangles;
  for (int slab = 0; slab < 64; ++slab)
    for (int i = 0; i < 6; ++i) {
      const float x = 10.0f * float(slab), y = 0.1f * float(i);
      triangles.push_back({glm::vec3(x, y, 0), glm::vec3(x, y + 0.05f, 0), glm::vec3(x, y, 0.1f)});
    }
  const auto frontier = encode_frontier(make_device(triangles), 32);
  for (std::uint32_t octant = 0; octant < FRONTIER_OCTANTS; ++octant) {
    const Line line = line_of(frontier, 32, octant);
    for (std::size_t i = 1; i < line.size(); ++i)
      EXPECT_EQ(line[i].box.lo.x < line[i - 1].box.lo.x, (octant & 1) != 0) << "octant " << octant << ", place " << i;
  }
}

TEST(FormatFrontier, AnEmptySceneHasOnlyEmptyPlaces) {
  EXPECT_TRUE(line_of(encode_frontier(make_device({}), 32), 32, 0).empty());
}

}  // namespace
}  // namespace ballot
