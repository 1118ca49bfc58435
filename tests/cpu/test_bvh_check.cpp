// Tests that check_bvh() names each invariant that a test breaks on purpose.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "engine/tree/host/bvh.h"
#include "tests/cpu/shapes.h"

namespace ballot {
namespace {

class BvhCheck : public testing::Test {
 protected:
  BvhCheck() : triangles_(shapes::slivers(300)), good_(build_bvh(triangles_)) {}

  void expect_found(const std::string& words, const std::function<void(Bvh&)>& damage) {
    Bvh bvh = good_;
    damage(bvh);
    std::string all;
    for (const std::string& line : check_bvh(bvh, triangles_, {}, 1000)) all += line + "\n";
    EXPECT_NE(all.find(words), std::string::npos) << "no line with '" << words << "' among:\n" << all;
  }

  std::size_t a_leaf(std::size_t least = 1) const {
    for (std::size_t i = 2; i < good_.nodes.size(); ++i)
      if (good_.nodes[i].count >= least) return i;
    return 0;
  }
  std::size_t an_inner() const {
    for (std::size_t i = 2; i < good_.nodes.size(); ++i)
      if (good_.nodes[i].count == 0) return i;
    return 0;
  }

  UnsetVector<Triangle> triangles_;
  Bvh good_;
};

TEST_F(BvhCheck, GoodTreeHasNoLine) {
  EXPECT_TRUE(check_bvh(good_, triangles_).empty());
  EXPECT_EQ(good_.nodes[0].count, 0u);
}

TEST_F(BvhCheck, Structure) {
  expect_found("even number", [](Bvh& b) { b.nodes.pop_back(); });
  expect_found("no nodes, but", [](Bvh& b) { b.nodes.clear(); });
  expect_found("not at 2", [](Bvh& b) { b.nodes[0].first = 4; });
  expect_found("is odd", [&](Bvh& b) { b.nodes[an_inner()].first += 1; });
  expect_found("child 4000000000 is out of range", [&](Bvh& b) { b.nodes[an_inner()].first = 4000000000u; });
  expect_found("child 0 is out of range", [&](Bvh& b) { b.nodes[an_inner()].first = 0; });
  expect_found("has another parent", [&](Bvh& b) { b.nodes[an_inner()].first = 2; });
  expect_found("is not reached", [&](Bvh& b) { b.nodes[an_inner()].first = 2; });
  expect_found("is not reached", [](Bvh& b) { b.nodes.resize(b.nodes.size() + 2); });
}

TEST_F(BvhCheck, Boxes) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  expect_found("not finite on y", [&](Bvh& b) { b.nodes[a_leaf()].lo.y = nan; });
  expect_found("not finite on z", [&](Bvh& b) { b.nodes[0].hi.z = inf; });
  expect_found("inverted on x", [&](Bvh& b) { b.nodes[a_leaf()].lo.x = b.nodes[a_leaf()].hi.x + 1; });
  expect_found("exceeds its parent's on z", [&](Bvh& b) { b.nodes[a_leaf()].hi.z += 10; });
  expect_found("larger than its children's together on x", [&](Bvh& b) {
    b.nodes[0].lo.x -= 1;
    b.bounds.lo.x -= 1;
  });
  expect_found("bounds differ", [](Bvh& b) { b.bounds.hi.y += 1; });
}

TEST_F(BvhCheck, Leaves) {
  expect_found("at most 6 are allowed", [&](Bvh& b) { b.nodes[a_leaf()].count = 9; });
  expect_found("references 1000000 to 1000000 are out of range", [&](Bvh& b) {
    b.nodes[a_leaf()] = {b.nodes[a_leaf()].lo, b.nodes[a_leaf()].hi, 1, 1000000};
  });
  expect_found("belongs to node", [&](Bvh& b) { b.nodes[a_leaf()].first += 1; });
  expect_found("belongs to no leaf", [](Bvh& b) { b.references.push_back(0); });
  expect_found("names triangle 300", [](Bvh& b) { b.references[5] = 300; });
  expect_found("twice", [&](Bvh& b) {
    const BvhNode& leaf = b.nodes[a_leaf(2)];
    b.references[leaf.first + 1] = b.references[leaf.first];
  });
}

TEST_F(BvhCheck, Triangles) {
  expect_found("triangle 17 is not referenced", [](Bvh& b) {
    for (std::uint32_t& prim : b.references)
      if (prim == 17) prim = 18;
  });
  expect_found("lies outside the boxes", [&](Bvh& b) {
    BvhNode& leaf = b.nodes[a_leaf()];
    leaf.lo = leaf.hi;
  });
  triangles_[40][1] = triangles_[40][0];
  expect_found("triangle 40 has no area, but is referenced", [](Bvh&) {});
}

TEST_F(BvhCheck, AGapBetweenSplitBoxesIsFound) {
  triangles_ = {{{{0, 0, 0}, {4, 1, 0}, {4, 2, 1}}}};
  Bvh bvh;
  bvh.nodes = {{{0, 0, 0}, {4, 2, 1}, 0, 2}, {}, {{0, 0, 0}, {2, 2, 1}, 1, 0}, {{2, 0, 0}, {4, 2, 1}, 1, 1}};
  bvh.references = {0, 0};
  good_ = bvh;
  expect_found("an edge lies outside", [](Bvh& b) { b.nodes[3].lo.x = std::nextafter(2.f, 3.f); });
  std::string all;
  for (const std::string& line : check_bvh(bvh, triangles_, {}, 1000)) all += line;
  EXPECT_EQ(all.find("outside"), std::string::npos) << all;
}

TEST_F(BvhCheck, Statistics) {
  expect_found("stats: triangles", [](Bvh& b) { ++b.stats.triangles; });
  expect_found("stats: degenerate", [](Bvh& b) { ++b.stats.degenerate; });
  expect_found("stats: references", [](Bvh& b) { ++b.stats.references; });
  expect_found("stats: nodes", [](Bvh& b) { ++b.stats.nodes; });
  expect_found("stats: leaves", [](Bvh& b) { ++b.stats.leaves; });
  expect_found("stats: depth", [](Bvh& b) { ++b.stats.depth; });
  expect_found("stats: largest leaf", [](Bvh& b) { --b.stats.largest_leaf; });
  expect_found("stats: bytes", [](Bvh& b) { ++b.stats.bytes; });
  expect_found("stats: sah", [](Bvh& b) { b.stats.sah *= 1.01; });
}

TEST_F(BvhCheck, LinesAreLimited) {
  Bvh bvh = good_;
  for (BvhNode& node : bvh.nodes) node.lo.x = 5;
  EXPECT_EQ(check_bvh(bvh, triangles_, {}, 3).size(), 3u);
}

}  // namespace
}  // namespace ballot
