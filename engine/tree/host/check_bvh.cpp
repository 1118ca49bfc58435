// Checks every invariant of the reference form. check_cover.cpp checks that the boxes of split triangles cover them.
#include <algorithm>
#include <cmath>

#include "engine/core/error.h"
#include "engine/tree/host/build.h"
#include "engine/tree/host/check_cover.h"

namespace ballot {
namespace {

bool inside(const BvhNode& child, const BvhNode& parent, int axis) {
  return child.lo[axis] >= parent.lo[axis] && child.hi[axis] <= parent.hi[axis];
}

class Checker {
 public:
  Checker(const Bvh& bvh, std::span<const Triangle> triangles, const BuildSettings& settings, std::size_t limit)
      : bvh_(bvh), triangles_(triangles), settings_(settings), limit_(limit) {}

  std::vector<std::string> run() {
    if (bvh_.nodes.empty()) {
      if (!bvh_.references.empty()) say("no nodes, but {} references", bvh_.references.size());
    } else if (bvh_.nodes.size() < 2 || bvh_.nodes.size() % 2 != 0) {
      say("{} nodes, expected an even number of at least 2", bvh_.nodes.size());
    } else {
      walk();
      check_orphans();
    }
    check_references();
    check_triangles();
    check_stats();
    return std::move(lines_);
  }

 private:
  struct Step {
    std::uint32_t node, inner_above;
  };

  template <class... Args>
  void say(fmt::format_string<Args...> text, Args&&... args) {
    if (lines_.size() < limit_) lines_.push_back(fmt::format(text, std::forward<Args>(args)...));
  }

  void walk() {
    visited_.assign(bvh_.nodes.size(), false);
    owner_.assign(bvh_.references.size(), kNobody);
    visited_[0] = true;
    check_box(0);
    const BvhNode& root = bvh_.nodes[0];
    if (root.lo != bvh_.bounds.lo || root.hi != bvh_.bounds.hi) say("the bounds differ from the root's box");
    if (root.count == 0 && root.first != 2) say("node 0: the root's children start at {}, not at 2", root.first);
    std::vector<Step> todo{{0, 0}};
    while (!todo.empty()) {
      const Step step = todo.back();
      todo.pop_back();
      add_cost(step.node);
      if (bvh_.nodes[step.node].count > 0) {
        check_leaf(step.node);
        depth_ = std::max(depth_, step.inner_above);
      } else if (check_inner(step.node)) {
        const std::uint32_t first = bvh_.nodes[step.node].first;
        todo.push_back({first + 1, step.inner_above + 1});
        todo.push_back({first, step.inner_above + 1});
      }
    }
  }

  // Checks an inner node. Returns true if its children may be visited.
  bool check_inner(std::uint32_t index) {
    const BvhNode& node = bvh_.nodes[index];
    if (node.first < 2 || node.first >= bvh_.nodes.size() - 1) {
      say("node {}: child {} is out of range, the tree has {} nodes", index, node.first, bvh_.nodes.size());
      return false;
    }
    if (node.first % 2 != 0) {
      say("node {}: the pair of its children starts at {}, which is odd", index, node.first);
      return false;
    }
    const std::uint32_t left = node.first, right = node.first + 1;
    if (visited_[left]) {
      say("node {}: child {} has another parent already", index, left);
      return false;
    }
    visited_[left] = visited_[right] = true;
    for (const std::uint32_t child : {left, right}) check_box(child);
    for (int axis = 0; axis < 3; ++axis) check_union(index, axis);
    return true;
  }

  void check_union(std::uint32_t index, int axis) {
    const BvhNode& node = bvh_.nodes[index];
    const BvhNode& left = bvh_.nodes[node.first];
    const BvhNode& right = bvh_.nodes[node.first + 1];
    const char name = "xyz"[axis];
    if (!inside(left, node, axis)) say("node {}: box of child {} exceeds its parent's on {}", index, node.first, name);
    if (!inside(right, node, axis))
      say("node {}: box of child {} exceeds its parent's on {}", index, node.first + 1, name);
    if (node.lo[axis] < std::min(left.lo[axis], right.lo[axis]) ||
        node.hi[axis] > std::max(left.hi[axis], right.hi[axis]))
      say("node {}: box is larger than its children's together on {}", index, name);
  }

  void check_box(std::uint32_t index) {
    const BvhNode& node = bvh_.nodes[index];
    for (int axis = 0; axis < 3; ++axis) {
      const float lo = node.lo[axis], hi = node.hi[axis];
      if (!std::isfinite(lo) || !std::isfinite(hi))
        say("node {}: box is not finite on {} ({} to {})", index, "xyz"[axis], lo, hi);
      else if (lo > hi)
        say("node {}: box is inverted on {} ({} to {})", index, "xyz"[axis], lo, hi);
    }
  }

  void check_leaf(std::uint32_t index) {
    const BvhNode& node = bvh_.nodes[index];
    ++leaves_;
    largest_leaf_ = std::max(largest_leaf_, node.count);
    if (node.count > settings_.max_leaf)
      say("node {}: leaf of {} references, at most {} are allowed", index, node.count, settings_.max_leaf);
    if (node.first > bvh_.references.size() || node.count > bvh_.references.size() - node.first) {
      say("node {}: references {} to {} are out of range, there are {}", index, node.first,
          std::uint64_t{node.first} + node.count - 1, bvh_.references.size());
      return;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      if (owner_[i] != kNobody) say("reference {} belongs to node {} and to node {}", i, owner_[i], index);
      owner_[i] = index;
      const auto* begin = bvh_.references.data() + node.first;
      if (std::find(begin, bvh_.references.data() + i, bvh_.references[i]) != bvh_.references.data() + i)
        say("node {}: leaf holds triangle {} twice", index, bvh_.references[i]);
    }
  }

  void check_orphans() {
    for (std::size_t i = 0; i < bvh_.nodes.size(); ++i)
      if (i != 1 && !visited_[i]) say("node {} is not reached from the root", i);
  }

  void check_references() {
    if (owner_.size() != bvh_.references.size()) owner_.assign(bvh_.references.size(), kNobody);
    for (std::size_t i = 0; i < owner_.size(); ++i) {
      if (owner_[i] == kNobody) say("reference {} belongs to no leaf", i);
      if (bvh_.references[i] >= triangles_.size())
        say("reference {} names triangle {}, the scene has {}", i, bvh_.references[i], triangles_.size());
    }
  }

  void check_triangles() {
    const LeavesOfTriangles leaves(bvh_, owner_, triangles_.size());
    for (std::size_t prim = 0; prim < triangles_.size(); ++prim) {
      const auto boxes = leaves.of(prim);
      if (is_degenerate(triangles_[prim])) {
        ++degenerate_;
        if (!boxes.empty()) say("triangle {} has no area, but is referenced", prim);
      } else if (boxes.empty()) {
        say("triangle {} is not referenced", prim);
      } else if (const char* what = uncovered(triangles_[prim], boxes, bvh_.nodes)) {
        say("triangle {}: {} lies outside the boxes of its {} leaves", prim, what, boxes.size());
      }
    }
  }

  void add_cost(std::uint32_t index) {
    const BvhNode& node = bvh_.nodes[index];
    cost_ += half_area(node.lo, node.hi) *
             (node.count == 0 ? double{settings_.traversal_cost} : double{settings_.intersection_cost} * node.count);
  }

  void check_stats() {
    const BvhStats& s = bvh_.stats;
    const auto same = [&](const char* name, std::uint64_t stated, std::uint64_t found) {
      if (stated != found) say("stats: {} is {}, counted {}", name, stated, found);
    };
    same("triangles", s.triangles, triangles_.size());
    same("degenerate", s.degenerate, degenerate_);
    same("references", s.references, bvh_.references.size());
    same("nodes", s.nodes, bvh_.nodes.empty() ? 0 : bvh_.nodes.size() - 1);
    same("leaves", s.leaves, leaves_);
    same("depth", s.depth, depth_);
    same("largest leaf", s.largest_leaf, largest_leaf_);
    same("bytes", s.bytes, bvh_.nodes.size() * sizeof(BvhNode) + bvh_.references.size() * sizeof(std::uint32_t));
    const double whole = bvh_.nodes.empty() ? 0 : half_area(bvh_.nodes[0].lo, bvh_.nodes[0].hi);
    if (whole > 0 && !(std::abs(s.sah - cost_ / whole) <= 1e-6 * s.sah))
      say("stats: sah is {}, computed {}", s.sah, cost_ / whole);
  }

  const Bvh& bvh_;
  std::span<const Triangle> triangles_;
  const BuildSettings& settings_;
  std::size_t limit_;
  std::vector<std::string> lines_;
  std::vector<bool> visited_;
  std::vector<std::uint32_t> owner_;  // leaf node of each reference, or kNobody
  std::uint32_t leaves_ = 0, degenerate_ = 0, depth_ = 0, largest_leaf_ = 0;
  double cost_ = 0;
};

}  // namespace

std::vector<std::string> check_bvh(const Bvh& bvh, std::span<const Triangle> triangles, const BuildSettings& settings,
                                   std::size_t limit) {
  return Checker(bvh, triangles, settings, limit).run();
}

}  // namespace ballot
