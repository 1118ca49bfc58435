// Boxes. A node's box in the space of its mesh has its middle and half its sides in double precision, without rounding
// but for 2^-53 of themselves. An instance moves float32 corners, which are off by at most 4 * 2^-24 S_k from where the
// exact map puts them (engine/oracle/oracle_scene.cpp has S): boxes are widened by 5 * 2^-24 S_k. Each box is widened
// by 2^-46 of the size of its coordinates, which covers the rounding of its middle and of the pose.
#include "engine/answer/clearance.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <limits>

#include "engine/core/interruption.h"
#include "engine/oracle/walker.h"
#include "engine/tree/host/build.h"

namespace ballot {

namespace {

constexpr double kWiden = 0x1p-46;
constexpr std::uint32_t kNoPart = ~0u;

/// A box by its middle and half its sides.
struct Block {
  glm::dvec3 middle, half;
};

Block block_of(const Bounds& box) {
  const glm::dvec3 middle = 0.5 * (glm::dvec3(box.lo) + glm::dvec3(box.hi));
  return {middle, glm::dvec3(box.hi) - middle};
}

/// Returns a block that holds what a matrix makes of one.
template <class Number>
Block moved(const Block& block, const Number (&m)[3][4]) {
  Block to;
  for (int k = 0; k < 3; ++k) {
    to.middle[k] = double(m[k][3]), to.half[k] = 0;
    double size = std::abs(to.middle[k]);
    for (int j = 0; j < 3; ++j) {
      const double factor = double(m[k][j]);
      to.middle[k] += factor * block.middle[j], to.half[k] += std::abs(factor) * block.half[j];
      size += std::abs(factor) * (std::abs(block.middle[j]) + block.half[j]);
    }
    to.half[k] += kWiden * size;
  }
  return to;
}

struct Matrix {
  double m[3][4];
};

glm::dvec3 moved(const glm::dvec3& v, const Matrix& by) {
  glm::dvec3 to;
  for (int k = 0; k < 3; ++k) to[k] = by.m[k][0] * v.x + by.m[k][1] * v.y + by.m[k][2] * v.z + by.m[k][3];
  return to;
}

/// Returns a lower bound of the square of the distance of two blocks.
double square_between(const Block& a, const Block& b) {
  const glm::dvec3 out = glm::max(glm::abs(a.middle - b.middle) * (1 - 0x1p-50) - (a.half + b.half), 0.0);
  return glm::dot(out, out) * (1 - 0x1p-48);
}

/// A node of a side: of the tree over its parts, or of the tree of one.
struct Node {
  std::uint32_t part = kNoPart, ref = 0;
  bool leaf = false;
  Block block;
};

}  // namespace

/// A scene as the walk sees it: the trees of meshes where they are placed, and a tree over these.
class ClearanceWalk::Side {
 public:
  explicit Side(const OracleScene& scene) {
    const Forest* forest = scene.forest();
    if (!forest) {
      if (scene.trees()[0]->root != END_OF_TREE) parts_.push_back({scene.trees()[0], nullptr, 0, {}});
      return;
    }
    for (std::uint32_t i = 0; i < forest->size(); ++i) {
      const PairTree* tree = scene.trees()[forest->mesh_of(i)];
      if (tree->root == END_OF_TREE) continue;
      parts_.push_back({tree, &forest->transforms()[i], forest->first_of(i), room_of(forest->transforms()[i], *tree)});
    }
    std::vector<Bounds> boxes;
    for (std::uint32_t i = 0; i < parts_.size(); ++i) {
      const Block b = place(i, block_of(parts_[i].tree->bounds));
      boxes.push_back(rounded_outwards(b.middle - b.half, b.middle + b.half));
    }
    if (parts_.size() > 1) top_ = build_box_bvh(boxes);
  }

  bool empty() const { return parts_.empty(); }
  /// Returns the node that all others lie below. There is one.
  Node root() const {
    if (parts_.size() == 1) return root_of_part(0);
    return {kNoPart, 0, false, block_of({top_.nodes[0].lo, top_.nodes[0].hi})};
  }
  /// Calls visit(node) for the children of a node that is no leaf.
  template <class Visit>
  void for_children(const Node& node, const Visit& visit) const {
    if (node.part != kNoPart) {
      const Part& part = parts_[node.part];
      const DevicePair pair = children_of(*part.tree, node.ref);
      for (const DeviceChild& child : {pair.left, pair.right})
        if (child.ref != END_OF_TREE)
          visit(Node{node.part, child.ref, is_leaf(child.ref), place(node.part, block_of(child.box))});
      return;
    }
    const BvhNode& top = top_.nodes[node.ref];
    for (std::uint32_t i = 0; top.count > 0 && i < top.count; ++i) visit(root_of_part(top_.references[top.first + i]));
    if (top.count > 0) return;
    for (const std::uint32_t child : {top.first, top.first + 1})
      visit(Node{kNoPart, child, false, block_of({top_.nodes[child].lo, top_.nodes[child].hi})});
  }
  /// Calls visit(prim, triangle) for the triangles of a leaf.
  template <class Visit>
  void for_triangles(const Node& leaf, const Visit& visit) const {
    const Part& part = parts_[leaf.part];
    visit_leaf(*part.tree, leaf.ref, [&](std::uint32_t texel) {
      const Triangle t = decode_triangle(*part.tree, texel);
      visit(part.first + decode_prim(*part.tree, texel), part.transform ? moved_corners(*part.transform, t) : t);
      return true;
    });
  }

 private:
  struct Part {
    const PairTree* tree;
    const Transform* transform;  // null: it is where it is
    std::uint32_t first;         // number of its first triangle
    glm::dvec3 room;             // for the rounding of its corners
  };

  static glm::dvec3 room_of(const Transform& t, const PairTree& tree) {
    glm::dvec3 room;
    for (int k = 0; k < 3; ++k) {
      double sum = std::abs(double(t.m[k][3]));
      for (int j = 0; j < 3; ++j)
        sum += std::abs(double(t.m[k][j])) *
               std::max(std::abs(double(tree.bounds.lo[j])), std::abs(double(tree.bounds.hi[j])));
      room[k] = 5 * 0x1p-24 * sum + 0x1p-120;
    }
    return room;
  }
  Block place(std::uint32_t part, const Block& block) const {
    const Part& p = parts_[part];
    if (!p.transform) return block;
    Block to = moved(block, p.transform->m);
    to.half += p.room;
    return to;
  }
  Node root_of_part(std::uint32_t part) const {
    const PairTree& tree = *parts_[part].tree;
    return {part, tree.root, is_leaf(tree.root), place(part, block_of(tree.bounds))};
  }

  std::vector<Part> parts_;
  Bvh top_;  // over the parts, if there are several
};

namespace {

/// The nearest pair so far.
class Best {
 public:
  explicit Best(double limit) : limit_(limit) { found_.distance = limit; }
  /// Returns false if boxes with such a bound hold nothing that is wanted.
  bool wants(double square) const {
    return found_.distance > 0 && square <= found_.distance * found_.distance * (1 + 0x1p-40);
  }
  void take(const TriangleGap& gap, std::uint32_t prim, std::uint32_t other) {
    if (!(gap.distance <= limit_)) return;
    const bool nearer = found_.prim == NO_HIT || gap.distance < found_.distance;
    const bool first = std::pair(prim, other) < std::pair(found_.prim, found_.other_prim);
    if (nearer || (gap.distance == found_.distance && first)) found_ = {gap.distance, prim, other, gap.a, gap.b};
  }
  std::optional<Clearance> found() const { return found_.prim == NO_HIT ? std::nullopt : std::optional(found_); }

 private:
  double limit_;
  Clearance found_;
};

Block block_of(const TriangleInDouble& t) {
  const glm::dvec3 lo = glm::min(glm::min(t[0], t[1]), t[2]), hi = glm::max(glm::max(t[0], t[1]), t[2]);
  return {0.5 * (lo + hi), (0.5 * (hi - lo)) * (1 + 0x1p-40)};
}

/// NodePairs of nodes that are still to be visited, the nearest first among those of a step.
struct NodePairs {
  struct Pair {
    Node a, b;  // b lies where the pose puts it
    double square;
  };
  void push_nearest_last(std::size_t from) {
    std::sort(all.begin() + std::ptrdiff_t(from), all.end(),
              [](const Pair& a, const Pair& b) { return a.square > b.square; });
  }
  std::vector<Pair> all;
};

}  // namespace

ClearanceWalk::ClearanceWalk(const OracleScene& scene, const OracleScene& other)
    : side_(std::make_unique<const Side>(scene)), other_(std::make_unique<const Side>(other)) {}
ClearanceWalk::~ClearanceWalk() = default;

std::optional<Clearance> ClearanceWalk::find(const PoseInDouble& pose, double limit) const {
  if (side_->empty() || other_->empty() || !(limit >= 0)) return {};
  Matrix matrix;
  for (std::size_t k = 0; k < 3; ++k) std::ranges::copy(pose[k], matrix.m[k]);
  Best best(limit);
  NodePairs pairs;
  const auto posed = [&](Node node) {
    node.block = moved(node.block, matrix.m);
    return node;
  };
  const auto push = [&](const Node& a, const Node& b) {
    const double square = square_between(a.block, b.block);
    if (best.wants(square)) pairs.all.push_back({a, b, square});
  };
  const auto meet = [&](const Node& a, const Node& b) {
    std::vector<std::pair<std::uint32_t, TriangleInDouble>> others;
    other_->for_triangles(b, [&](std::uint32_t prim, const Triangle& t) {
      TriangleInDouble corners;
      for (std::size_t i = 0; i < 3; ++i) corners[i] = moved(glm::dvec3(t[i]), matrix);
      others.emplace_back(prim, corners);
    });
    side_->for_triangles(a, [&](std::uint32_t prim, const Triangle& t) {
      const TriangleInDouble corners{glm::dvec3(t[0]), glm::dvec3(t[1]), glm::dvec3(t[2])};
      const Block block = block_of(corners);
      for (const auto& [other, there] : others)
        if (best.wants(square_between(block, block_of(there))))
          best.take(triangle_distance(corners, there), prim, other);
    });
  };
  push(side_->root(), posed(other_->root()));
  std::uint32_t steps = 0;
  while (!pairs.all.empty()) {
    const NodePairs::Pair pair = pairs.all.back();
    pairs.all.pop_back();
    if (!best.wants(pair.square)) continue;
    if (++steps % 4096 == 0) check_interruption();
    if (pair.a.leaf && pair.b.leaf) {
      meet(pair.a, pair.b);
      continue;
    }
    const std::size_t from = pairs.all.size();
    const bool first =
        pair.b.leaf || (!pair.a.leaf && glm::length(pair.a.block.half) >= glm::length(pair.b.block.half));
    if (first)
      side_->for_children(pair.a, [&](const Node& child) { push(child, pair.b); });
    else
      // Nodes of the other scene are kept as the pose puts them; their children are placed anew.
      other_->for_children(pair.b, [&](const Node& child) { push(pair.a, posed(child)); });
    pairs.push_nearest_last(from);
  }
  return best.found();
}

}  // namespace ballot
