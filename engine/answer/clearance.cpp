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

// Named, as ClearanceWalk::Walk holds types of it.
namespace clearance {

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

}  // namespace clearance

using namespace clearance;

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

namespace clearance {

/// A triangle as pairs of them are told apart before their distance is computed.
struct Facet {
  Facet(std::uint32_t number, const TriangleInDouble& t) : prim(number), corner(t) {
    const glm::dvec3 lo = glm::min(glm::min(t[0], t[1]), t[2]), hi = glm::max(glm::max(t[0], t[1]), t[2]);
    block = {0.5 * (lo + hi), (0.5 * (hi - lo)) * (1 + 0x1p-40)};
    normal = glm::cross(t[1] - t[0], t[2] - t[0]);
    length = glm::length(normal);
  }
  /// Returns a lower bound of the distance of the other triangle's corners from the plane, if they lie on one side. The
  /// normal is off by 2^-50 of the product of two edges: the thinner the triangle, the less is known.
  double plane_gap(const Facet& other) const {
    double least = std::numeric_limits<double>::infinity(), most = -least, size = 0;
    for (const glm::dvec3& c : other.corner) {
      const glm::dvec3 from = c - corner[0];
      const double height = glm::dot(normal, from);
      least = std::min(least, height), most = std::max(most, height);
      size = std::max({size, std::abs(from.x), std::abs(from.y), std::abs(from.z)});
    }
    const double gap = std::max(least, -most), off = 0x1p-44 * size * glm::dot(block.half, block.half);
    return gap > off ? (gap - off) / (length * (1 + 0x1p-40)) : 0;
  }

  /// Returns a lower bound of the square of the distance of a block.
  double square_from(const Block& other) const {
    const glm::dvec3 from = other.middle - corner[0], size = glm::abs(from) + other.half;
    const double reach = glm::dot(glm::abs(normal), other.half), height = std::abs(glm::dot(normal, from));
    const double off = 0x1p-44 * (std::max({size.x, size.y, size.z}) * glm::dot(block.half, block.half) + reach);
    const double gap = height - reach - off, apart = gap > 0 ? gap / (length * (1 + 0x1p-40)) : 0;
    return std::max(square_between(block, other), apart * apart * (1 - 0x1p-40));
  }

  std::uint32_t prim;
  TriangleInDouble corner;
  Block block;
  glm::dvec3 normal;
  double length;
};

/// The nearest pair so far.
class Best {
 public:
  explicit Best(double limit) : limit_(limit) { found_.distance = limit; }
  /// Returns false if boxes with such a bound hold nothing that is wanted.
  bool wants(double square) const {
    return found_.distance > 0 && square <= found_.distance * found_.distance * (1 + 0x1p-40);
  }
  bool wants(const Facet& a, const Facet& b) const {
    if (!wants(square_between(a.block, b.block))) return false;
    const double gap = std::max(a.plane_gap(b), b.plane_gap(a));
    return wants(gap * gap);
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

}  // namespace clearance

/// A walk of both trees, the nearest pair of nodes first.
class ClearanceWalk::Walk {
 public:
  Walk(const Side& side, const Side& other, const PoseInDouble& pose, double limit)
      : side_(side), other_(other), best_(limit) {
    for (std::size_t k = 0; k < 3; ++k) std::ranges::copy(pose[k], pose_.m[k]);
  }

  std::optional<Clearance> run() {
    push(side_.root(), posed(other_.root()));
    for (std::uint32_t steps = 1; !pairs_.empty(); ++steps) {
      if (steps % 4096 == 0) check_interruption();
      std::ranges::pop_heap(pairs_, std::ranges::greater{}, &Pair::square);
      const Pair pair = pairs_.back();
      pairs_.pop_back();
      if (!best_.wants(pair.square)) break;  // nor are the others
      if (pair.a.leaf && pair.b.leaf)
        meet(pair.a, pair.b);
      else if (pair.b.leaf || (!pair.a.leaf && glm::length(pair.a.block.half) >= glm::length(pair.b.block.half)))
        side_.for_children(pair.a, [&](const Node& child) { push(child, pair.b); });
      else
        other_.for_children(pair.b, [&](const Node& child) { push(pair.a, posed(child)); });
    }
    return best_.found();
  }

 private:
  struct Pair {
    Node a, b;  // b lies where the pose puts it
    double square;
  };

  Node posed(Node node) const {
    node.block = moved(node.block, pose_.m);
    return node;
  }
  void push(const Node& a, const Node& b) {
    double square = square_between(a.block, b.block);
    if (!best_.wants(square)) return;
    if (a.leaf != b.leaf) square = std::max(square, a.leaf ? square_from(of_side(a), b) : square_from(of_other(b), a));
    if (!best_.wants(square)) return;
    pairs_.push_back({a, b, square});
    std::ranges::push_heap(pairs_, std::ranges::greater{}, &Pair::square);
  }
  /// Return the triangles of a leaf, valid until the next call.
  std::span<const Facet> of_side(const Node& leaf) {
    facets_.clear();
    side_.for_triangles(leaf, [&](std::uint32_t prim, const Triangle& t) {
      facets_.emplace_back(prim, TriangleInDouble{glm::dvec3(t[0]), glm::dvec3(t[1]), glm::dvec3(t[2])});
    });
    return facets_;
  }
  std::span<const Facet> of_other(const Node& leaf) {
    other_facets_.clear();
    other_.for_triangles(leaf, [&](std::uint32_t prim, const Triangle& t) {
      other_facets_.emplace_back(prim, TriangleInDouble{moved(glm::dvec3(t[0]), pose_), moved(glm::dvec3(t[1]), pose_),
                                                        moved(glm::dvec3(t[2]), pose_)});
    });
    return other_facets_;
  }
  static double square_from(std::span<const Facet> facets, const Node& node) {
    double least = std::numeric_limits<double>::infinity();
    for (const Facet& facet : facets) least = std::min(least, facet.square_from(node.block));
    return least;
  }
  void meet(const Node& a, const Node& b) {
    const std::span<const Facet> others = of_other(b);
    for (const Facet& facet : of_side(a))
      for (const Facet& other : others)
        if (best_.wants(facet, other))
          best_.take(triangle_distance(facet.corner, other.corner), facet.prim, other.prim);
  }

  const Side &side_, &other_;
  Matrix pose_;
  Best best_;
  std::vector<Pair> pairs_;  // a heap
  std::vector<Facet> facets_, other_facets_;
};

ClearanceWalk::ClearanceWalk(const OracleScene& scene, const OracleScene& other)
    : side_(std::make_unique<const Side>(scene)), other_(std::make_unique<const Side>(other)) {}
ClearanceWalk::~ClearanceWalk() = default;

std::optional<Clearance> ClearanceWalk::find(const PoseInDouble& pose, double limit) const {
  if (side_->empty() || other_->empty() || !(limit >= 0)) return {};
  return Walk(*side_, *other_, pose, limit).run();
}

}  // namespace ballot
