// The wide tree holds the leaves of the binary tree, each once, and no other collapse has less area.
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "engine/bvh/device_decode.h"
#include "engine/bvh/wide.h"
#include "tests/cpu/shapes.h"

namespace ballot {
namespace {

struct Child {
  Bounds box;
  std::uint32_t ref;
};

std::vector<Child> children_of(const WideBvh& wide, std::uint32_t node) {
  std::vector<Child> all;
  for (std::uint32_t c = 0; c < WIDE_CHILDREN; ++c) {
    const glm::uvec4 &lo = wide.nodes[node * WIDE_NODE_TEXELS + c],
                     &hi = wide.nodes[node * WIDE_NODE_TEXELS + WIDE_CHILDREN + c];
    if (lo.w != END_OF_TREE) all.push_back({{as_vec3(lo), as_vec3(hi)}, lo.w});
  }
  return all;
}

struct Sizes {
  std::map<std::uint32_t, Bounds> leaves;  // by reference
  double area = 0;                         // of the nodes
  std::uint32_t depth = 0, children = 0;
};

double area(const Bounds& b) {
  const glm::dvec3 e = glm::dvec3(b.hi) - glm::dvec3(b.lo);
  return e.x * e.y + e.y * e.z + e.z * e.x;
}

void walk(const WideBvh& wide, std::uint32_t node, std::uint32_t level, Sizes& sizes) {
  Bounds box{glm::vec3(1e38f), glm::vec3(-1e38f)};
  sizes.depth = std::max(sizes.depth, level);
  for (const Child& c : children_of(wide, node)) {
    ++sizes.children;
    box = {glm::min(box.lo, c.box.lo), glm::max(box.hi, c.box.hi)};
    if (!is_leaf(c.ref))
      walk(wide, c.ref, level + 1, sizes);
    else
      EXPECT_TRUE(sizes.leaves.emplace(c.ref, c.box).second) << "leaf " << c.ref << " twice";
  }
  sizes.area += area(box);
}

void leaves_of(const DeviceBvh& bvh, const DeviceChild& at, std::map<std::uint32_t, Bounds>& out) {
  if (is_leaf(at.ref)) {
    out.emplace(at.ref, at.box);
    return;
  }
  const DevicePair pair = decode_pair(bvh, at.ref);
  leaves_of(bvh, pair.left, out);
  leaves_of(bvh, pair.right, out);
}

struct Made {
  DeviceBvh binary;
  WideBvh wide;
};

Made make(const shapes::Triangles& triangles, NodeLayout layout = NodeLayout::Interleaved) {
  const Bvh bvh = build_bvh(triangles);
  Made made{make_device_bvh(bvh, triangles, layout), {}};
  made.wide = make_wide_bvh(made.binary);
  return made;
}

TEST(BvhWide, HoldsEveryLeafOnce) {
  for (const shapes::Triangles& triangles :
       {shapes::soup(1, 1), shapes::soup(7, 1), shapes::soup(3000, 0.1f), shapes::sphere(5), shapes::identical(300)})
    for (const NodeLayout layout : {NodeLayout::Interleaved, NodeLayout::Paper}) {
      const Made made = make(triangles, layout);
      Sizes sizes;
      walk(made.wide, 0, 1, sizes);
      std::map<std::uint32_t, Bounds> leaves;
      leaves_of(made.binary, {made.binary.bounds, made.binary.root}, leaves);
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

TEST(BvhWide, AnEmptySceneHasNoNodes) { EXPECT_TRUE(make({}).wide.nodes.empty()); }

using Cut = std::vector<DeviceChild>;

// Every way to cut the tree below a pair of siblings into at most eight subtrees.
std::vector<Cut> cuts_below(const DeviceBvh& bvh, std::uint32_t pair_at) {
  const DevicePair pair = decode_pair(bvh, pair_at);
  const auto cuts_of = [&](const DeviceChild& child) {
    std::vector<Cut> cuts = is_leaf(child.ref) ? std::vector<Cut>() : cuts_below(bvh, child.ref);
    cuts.push_back({child});
    return cuts;
  };
  std::vector<Cut> all;
  const std::vector<Cut> rights = cuts_of(pair.right);
  for (const Cut& left : cuts_of(pair.left))
    for (const Cut& right : rights) {
      if (left.size() + right.size() > WIDE_CHILDREN) continue;
      all.push_back(left);
      all.back().insert(all.back().end(), right.begin(), right.end());
    }
  return all;
}

double least_area(const DeviceBvh& bvh, const DeviceChild& subtree) {
  if (is_leaf(subtree.ref)) return 0;
  double best = std::numeric_limits<double>::infinity();
  for (const Cut& cut : cuts_below(bvh, subtree.ref)) {
    double sum = 0;
    for (const DeviceChild& child : cut) sum += least_area(bvh, child);
    best = std::min(best, sum);
  }
  return best + area(subtree.box);
}

TEST(BvhWide, NoOtherCollapseHasLessArea) {
  for (const int count : {9, 12, 15}) {
    const shapes::Triangles triangles = shapes::soup(count, 0.2f);
    const Bvh bvh = build_bvh(triangles, {.max_leaf = 1, .split_budget = 0});
    const DeviceBvh binary = make_device_bvh(bvh, triangles, NodeLayout::Interleaved);
    Sizes sizes;
    walk(make_wide_bvh(binary), 0, 1, sizes);
    const double best = least_area(binary, {binary.bounds, binary.root});
    EXPECT_NEAR(sizes.area, best, 1e-5 * best) << count << " triangles";
  }
}

TEST(BvhWide, NodesAreWellFilled) {
  const Made made = make(shapes::sphere(6));
  const double filled = double(made.wide.children) / double(made.wide.nodes.size() / WIDE_NODE_TEXELS);
  EXPECT_GT(filled, 5.5);
}

}  // namespace
}  // namespace ballot
