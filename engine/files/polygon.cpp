#include "engine/files/polygon.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <deque>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <numeric>
#include <utility>

#include "engine/files/polygon_sweep.h"

namespace ballot {
namespace {

constexpr std::uint32_t kNobody = ~0u;

/// Returns the axis to project a polygon along: the largest of its normal (Newell's), or where areas of either
/// direction cancel out the one that it extends least along. `turn` becomes -1 if it is clockwise then.
int axis_of(std::span<const glm::vec3> polygon, double& turn) {
  glm::dvec3 normal{0}, lo{polygon[0]}, hi{polygon[0]};
  const glm::dvec3 origin{polygon[0]};
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const glm::dvec3 a = glm::dvec3{polygon[i]} - origin;
    const glm::dvec3 b = glm::dvec3{polygon[i + 1 < polygon.size() ? i + 1 : 0]} - origin;
    normal += glm::dvec3{(a.y - b.y) * (a.z + b.z), (a.z - b.z) * (a.x + b.x), (a.x - b.x) * (a.y + b.y)};
    lo = glm::min(lo, a + origin), hi = glm::max(hi, a + origin);
  }
  const auto largest = [](const glm::dvec3& v) { return v.x >= v.y && v.x >= v.z ? 0 : (v.y >= v.z ? 1 : 2); };
  const glm::dvec3 size = hi - lo;
  int axis = largest(glm::abs(normal));
  if (std::abs(normal[axis]) <= 1e-12 * glm::dot(size, size)) axis = largest(-size);
  turn = normal[axis] < 0 ? -1 : 1;
  return axis;
}

/// Projects a polygon so that it is counter-clockwise.
FlatPolygon flattened(std::span<const glm::vec3> polygon) {
  double turn = 1;
  const int axis = axis_of(polygon, turn), u = (axis + 1) % 3, v = (axis + 2) % 3;
  FlatPolygon flat;
  flat.points.reserve(polygon.size());
  glm::dvec2 most{0}, lo{polygon[0][u], polygon[0][v]}, hi = lo;
  for (const glm::vec3& p : polygon) {
    const glm::dvec2 at{p[u], p[v]};
    flat.points.emplace_back(turn * at.x, at.y);
    most = glm::max(most, glm::abs(at));
    lo = glm::min(lo, at), hi = glm::max(hi, at);
  }
  constexpr double kFew = 256;  // a polygon that is few roundings large is taken as it is
  flat.rounding = std::max(most.x, most.y) * 0x1p-22;
  if (std::max(hi.x - lo.x, hi.y - lo.y) < kFew * flat.rounding) flat.rounding = 0;
  return flat;
}

/// Returns true if the polygon never turns right and goes around once. Corners that repeat do not count.
bool is_convex(const std::vector<glm::dvec2>& points) {
  const std::size_t n = points.size();
  const auto edge = [&](std::size_t i) { return points[i + 1 < n ? i + 1 : 0] - points[i]; };
  const auto ahead = [](const glm::dvec2& e) { return e.x > 0 || (e.x == 0 && e.y > 0); };
  glm::dvec2 before{0};
  for (std::size_t i = n; i > 0 && before == glm::dvec2{0}; --i) before = edge(i - 1);
  int flips = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const glm::dvec2 now = edge(i);
    if (now == glm::dvec2{0}) continue;
    if (before.x * now.y - before.y * now.x < 0) return false;
    flips += ahead(before) != ahead(now);
    before = now;
  }
  return flips <= 2;
}

/// A counter-clockwise triangle with a margin, within which rounding may have moved a corner off its edges.
struct Ear {
  std::array<glm::dvec2, 3> at;
  std::array<double, 3> margin{};  // of side()
  glm::dvec2 lo, hi;               // with the margin

  Ear(const std::array<glm::dvec2, 3>& corners, double rounding)
      : at(corners),
        lo(glm::min(glm::min(at[0], at[1]), at[2]) - rounding),
        hi(glm::max(glm::max(at[0], at[1]), at[2]) + rounding) {
    for (std::size_t k = 0; k < 3; ++k) margin[k] = rounding * glm::distance(at[k], at[(k + 1) % 3]);
  }

  /// Returns on which side of edge k a point is: positive inside.
  double side(std::size_t k, const glm::dvec2& p) const { return flat_cross(at[k], at[(k + 1) % 3], p); }

  /// Returns true if a point is beside edge k, not beyond its ends.
  bool beside(std::size_t k, const glm::dvec2& p) const {
    const glm::dvec2 edge = at[(k + 1) % 3] - at[k];
    const double along = glm::dot(p - at[k], edge);
    return along > 0 && along < glm::dot(edge, edge);
  }
};

/// A tree of boxes over the corners that are left.
class CornerTree {
 public:
  explicit CornerTree(const std::vector<glm::dvec2>& points)
      : points_(points), order_(points.size()), place_(points.size()), nodes_(4 * points.size() / kLeaf + 4) {
    std::iota(order_.begin(), order_.end(), 0u);
    build(1, 0, order_.size());
    for (std::uint32_t i = 0; i < order_.size(); ++i) place_[order_[i]] = i;
  }

  /// Takes a corner out, once.
  void remove(std::uint32_t corner) {
    const std::size_t place = std::exchange(place_[corner], kNobody);
    std::size_t node = 1, begin = 0, end = order_.size();
    for (--nodes_[node].count; end - begin > kLeaf; --nodes_[node].count) {
      const std::size_t middle = (begin + end) / 2;
      node = 2 * node + (place >= middle);
      (place >= middle ? begin : end) = middle;
    }
  }

  /// Returns a corner that is in an ear or on its edge, and for which blocks(corner) is true; kNobody if there is none.
  template <class Blocks>
  std::uint32_t find(const Ear& ear, Blocks blocks) {
    return find(ear, blocks, 1, 0, order_.size());
  }

  /// Returns how many nodes all searches have visited.
  std::uint64_t steps() const { return steps_; }

 private:
  static constexpr std::size_t kLeaf = 8;
  struct Node {
    glm::dvec2 lo{0}, hi{0};
    std::uint32_t count = 0;  // of corners that are left
  };

  void build(std::size_t at, std::size_t begin, std::size_t end) {
    Node& node = nodes_[at];
    node.count = std::uint32_t(end - begin);
    node.lo = node.hi = points_[order_[begin]];
    for (std::size_t i = begin; i < end; ++i) {
      node.lo = glm::min(node.lo, points_[order_[i]]);
      node.hi = glm::max(node.hi, points_[order_[i]]);
    }
    if (end - begin <= kLeaf) return;
    const int axis = node.hi.x - node.lo.x >= node.hi.y - node.lo.y ? 0 : 1;
    const std::size_t middle = (begin + end) / 2;
    const auto of = [&](std::size_t i) { return order_.begin() + std::ptrdiff_t(i); };
    std::nth_element(of(begin), of(middle), of(end),
                     [&](std::uint32_t a, std::uint32_t b) { return points_[a][axis] < points_[b][axis]; });
    build(2 * at, begin, middle);
    build(2 * at + 1, middle, end);
  }

  static bool misses(const Node& node, const Ear& ear) {
    for (int axis = 0; axis < 2; ++axis)
      if (ear.hi[axis] < node.lo[axis] || ear.lo[axis] > node.hi[axis]) return true;
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::dvec2 edge = ear.at[(k + 1) % 3] - ear.at[k];
      const glm::dvec2 most{edge.y > 0 ? node.lo.x : node.hi.x, edge.x > 0 ? node.hi.y : node.lo.y};
      if (ear.side(k, most) < -ear.margin[k]) return true;
    }
    return false;
  }

  template <class Blocks>
  std::uint32_t find(const Ear& ear, Blocks& blocks, std::size_t node, std::size_t begin, std::size_t end) {
    ++steps_;
    if (nodes_[node].count == 0 || misses(nodes_[node], ear)) return kNobody;
    if (end - begin > kLeaf) {
      const std::size_t middle = (begin + end) / 2;
      const std::size_t second = (steps_ * 0x9E3779B97F4A7C15) >> 63;  // any corner, which stays for long on average
      for (const std::size_t child : {second, 1 - second}) {
        const std::uint32_t found = find(ear, blocks, 2 * node + child, child ? middle : begin, child ? end : middle);
        if (found != kNobody) return found;
      }
      return kNobody;
    }
    for (std::size_t i = begin; i < end; ++i)
      if (place_[order_[i]] != kNobody && blocks(order_[i])) return order_[i];
    return kNobody;
  }

  const std::vector<glm::dvec2>& points_;
  std::vector<std::uint32_t> order_, place_;  // corners by leaves; the place of each there, kNobody: removed
  std::vector<Node> nodes_;                   // the children of node i are 2 i and 2 i + 1
  std::uint64_t steps_ = 0;
};

/// Cuts ears off a polygon. A corner whose ear another corner blocks is tested again when that one has gone, so that
/// few tests are in vain. First go spikes and corners that repeat, then ears that no corner touches, then others.
class EarClipper {
 public:
  EarClipper(const FlatPolygon& polygon, std::vector<std::array<std::uint32_t, 3>>& triangles)
      : points_(polygon.points),
        rounding_(polygon.rounding),
        triangles_(triangles),
        tree_(points_),
        left_(points_.size()),
        before_(left_),
        after_(left_),
        ticket_(left_),
        waiting_(left_, kNobody) {
    for (std::uint32_t i = 0; i < left_; ++i) {
      before_[i] = i > 0 ? i - 1 : std::uint32_t(left_ - 1);
      after_[i] = i + 1 < left_ ? i + 1 : 0;
    }
    ask_all();
  }

  /// Cuts until nothing is left. Returns false if the polygon is not simple.
  bool run() {
    const std::uint64_t most_steps = 4096 * (points_.size() + 1024);
    while (left_ > 3) {
      if (queue_.empty() && stage_ != Stage::Touching) {
        stage_ = stage_ == Stage::Spikes ? Stage::Apart : Stage::Touching;
        ask_all();
      } else if (queue_.empty() || tree_.steps() > most_steps) {
        force();
      } else {
        const auto [corner, ticket] = queue_.front();
        queue_.pop_front();
        if (ticket == ticket_[corner] && (is_spike(corner) || (stage_ != Stage::Spikes && is_ear(corner)))) cut(corner);
      }
    }
    tangled_ |= turn(any_) < -slack(any_);
    triangles_.push_back({before_[any_], any_, after_[any_]});
    return !tangled_;
  }

 private:
  enum class Stage { Spikes, Apart, Touching };
  struct Waiting {
    std::uint32_t corner, next;
  };

  const glm::dvec2& at(std::uint32_t corner) const { return points_[corner]; }
  double turn(std::uint32_t i) const { return flat_cross(at(before_[i]), at(i), at(after_[i])); }
  double slack(std::uint32_t i) const {
    return rounding_ * std::max(glm::distance(at(before_[i]), at(i)), glm::distance(at(i), at(after_[i])));
  }

  /// Puts a corner at the end of the queue, once.
  void ask(std::uint32_t corner) { queue_.emplace_back(corner, ++ticket_[corner]); }

  void ask_all() {
    std::uint32_t i = any_;
    for (std::size_t k = 0; k < left_; ++k, i = after_[i]) ask(i);
  }

  /// Returns true if a corner repeats the one before, or the boundary turns back there. Edges that are long enough to
  /// tell may lie apart by rounding.
  bool is_spike(std::uint32_t i) const {
    const glm::dvec2 in = at(i) - at(before_[i]), out = at(after_[i]) - at(i);
    const double shorter = std::min(glm::length(in), glm::length(out));
    const double apart = shorter > 64 * rounding_ ? slack(i) : 0;
    return shorter == 0 || (std::abs(turn(i)) <= apart && glm::dot(in, out) < 0);
  }

  /// Returns true if a corner's triangle can be cut off. Else the corner waits for the one that is in the way.
  bool is_ear(std::uint32_t i) {
    if (turn(i) <= 0) return false;
    const std::array<std::uint32_t, 3> corners{before_[i], i, after_[i]};
    const Ear ear({at(corners[0]), at(i), at(corners[2])}, rounding_);
    const std::uint32_t blocker =
        tree_.find(ear, [&](std::uint32_t q) { return std::ranges::count(corners, q) == 0 && blocks(ear, q); });
    if (blocker == kNobody) return true;
    waits_.push_back({i, waiting_[blocker]});
    waiting_[blocker] = std::uint32_t(waits_.size() - 1);
    return false;
  }

  /// Returns true if a corner is in an ear so that this is none: inside, or on an edge of it. At a corner of the ear,
  /// and in the last stage anywhere on its edges, only a boundary that goes on into the ear counts.
  bool blocks(const Ear& ear, std::uint32_t q) const {
    std::array<bool, 3> on{};
    for (std::size_t k = 0; k < 3; ++k) {
      const double s = ear.side(k, at(q));
      on[k] = s == 0 || (s < 0 && s >= -ear.margin[k] && ear.beside(k, at(q)));
      if (s < 0 && !on[k]) return false;
    }
    const int edges = on[0] + on[1] + on[2];
    if (edges == 0 || (edges == 1 && stage_ == Stage::Apart)) return true;
    for (const std::uint32_t to : {before_[q], after_[q]}) {
      bool enters = true;
      for (std::size_t k = 0; k < 3; ++k) enters = enters && (!on[k] || ear.side(k, at(to)) > ear.margin[k]);
      if (enters) return true;
    }
    return false;
  }

  /// Cuts a corner off, and asks its neighbours and those that wait for it again.
  void cut(std::uint32_t i) {
    const std::uint32_t a = before_[i], b = after_[i];
    triangles_.push_back({a, i, b});
    after_[a] = b, before_[b] = a;
    any_ = b;
    after_[i] = kNobody;
    ++ticket_[i];
    --left_;
    tree_.remove(i);
    ask(a), ask(b);
    for (std::uint32_t w = waiting_[i]; w != kNobody; w = waits_[w].next)
      if (after_[waits_[w].corner] != kNobody) ask(waits_[w].corner);
  }

  /// Cuts a corner though it is no ear: the smallest of the next ones, convex if there is such. Unless its triangle has
  /// no area but for rounding, the polygon is not simple.
  void force() {
    constexpr std::size_t kLookedAt = 64;
    const auto cost = [this](std::uint32_t i) { return std::pair(turn(i) <= 0, std::abs(turn(i))); };
    std::uint32_t i = any_, least = any_;
    for (std::size_t k = 0; k < std::min(left_, kLookedAt); ++k, i = after_[i])
      if (cost(i) < cost(least)) least = i;
    tangled_ |= std::abs(turn(least)) > slack(least);
    cut(least);
  }

  const std::vector<glm::dvec2>& points_;
  double rounding_;
  std::vector<std::array<std::uint32_t, 3>>& triangles_;
  CornerTree tree_;
  std::size_t left_;
  std::vector<std::uint32_t> before_, after_;                       // of the corners that are left; kNobody: cut
  std::vector<std::uint32_t> ticket_, waiting_;                     // the last in the queue; head of a list in waits_
  std::vector<Waiting> waits_;                                      // corners that wait for one to go
  std::deque<std::pair<std::uint32_t, std::uint32_t>> queue_ = {};  // corners to be tested, with their tickets
  std::uint32_t any_ = 0;                                           // a corner that is left
  Stage stage_ = Stage::Spikes;
  bool tangled_ = false;
};

}  // namespace

bool triangulate(std::span<const glm::vec3> polygon, std::vector<std::array<std::uint32_t, 3>>& triangles) {
  if (polygon.size() > 3) {
    const FlatPolygon flat = flattened(polygon);
    if (!is_convex(flat.points)) {
      const bool crosses = crosses_itself(flat);
      return EarClipper(flat, triangles).run() && !crosses;
    }
  }
  for (std::uint32_t i = 2; i < polygon.size(); ++i) triangles.push_back({0, i - 1, i});
  return true;
}

}  // namespace ballot
