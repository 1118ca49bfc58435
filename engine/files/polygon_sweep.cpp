#include "engine/files/polygon_sweep.h"

#include <algorithm>
#include <cstdint>
#include <glm/geometric.hpp>
#include <iterator>
#include <set>
#include <tuple>

namespace ballot {
namespace {

/// Finds out by a sweep whether edges of a polygon cross (Shamos and Hoey, 1976). Edges that touch do not cross.
class Sweep {
 public:
  explicit Sweep(const FlatPolygon& polygon) : rounding_(polygon.rounding) {
    const std::vector<glm::dvec2>& p = polygon.points;
    const auto order = [](const glm::dvec2& a, const glm::dvec2& b) { return std::tie(a.x, a.y) < std::tie(b.x, b.y); };
    for (std::size_t i = 0; i < p.size(); ++i) {
      const glm::dvec2 &a = p[i], &b = p[i + 1 < p.size() ? i + 1 : 0];
      if (a == b) continue;
      edges_.push_back(order(a, b) ? Edge{a, b} : Edge{b, a});
    }
  }

  /// Returns true at the first crossing.
  bool finds_crossing() {
    std::vector<Event> events;
    for (std::uint32_t i = 0; i < edges_.size(); ++i) {
      events.push_back({edges_[i].left, true, i});
      events.push_back({edges_[i].right, false, i});
    }
    std::ranges::sort(events, [](const Event& a, const Event& b) {
      return std::tie(a.at.x, a.at.y, a.begins, a.edge) < std::tie(b.at.x, b.at.y, b.begins, b.edge);
    });
    const auto below = [this](std::uint32_t a, std::uint32_t b) { return is_below(a, b); };
    std::set<std::uint32_t, decltype(below)> cut(below);  // the edges at the sweep line, from below
    std::vector<decltype(cut.begin())> places(edges_.size(), cut.end());
    for (const Event& event : events) {
      auto place = places[event.edge];
      if (event.begins) place = places[event.edge] = cut.insert(event.edge).first;
      const auto above = std::next(place);
      const bool between = place != cut.begin() && above != cut.end();
      if (event.begins && place != cut.begin() && cross_each_other(*std::prev(place), event.edge)) return true;
      if (event.begins && above != cut.end() && cross_each_other(*above, event.edge)) return true;
      if (!event.begins && between && cross_each_other(*std::prev(place), *above)) return true;
      if (!event.begins) cut.erase(place);
    }
    return false;
  }

 private:
  struct Edge {
    glm::dvec2 left, right;
  };
  struct Event {
    glm::dvec2 at;
    bool begins;
    std::uint32_t edge;
  };

  /// Returns true if edge a is below edge b where both are. Edges of one line are in the order of their numbers.
  bool is_below(std::uint32_t a, std::uint32_t b) const {
    const Edge &e = edges_[a], &f = edges_[b];
    const bool first = std::tie(e.left.x, e.left.y) <= std::tie(f.left.x, f.left.y);
    double side = first ? flat_cross(e.left, e.right, f.left) : -flat_cross(f.left, f.right, e.left);
    if (side == 0) side = first ? flat_cross(e.left, e.right, f.right) : -flat_cross(f.left, f.right, e.right);
    return side != 0 ? side > 0 : a < b;
  }

  /// Returns true if the ends of each edge are on either side of the other one, by more than rounding explains.
  bool cross_each_other(std::uint32_t a, std::uint32_t b) const {
    const auto parts = [this](const Edge& line, const Edge& other) {
      const double least = rounding_ * glm::distance(line.left, line.right);
      const double p = flat_cross(line.left, line.right, other.left),
                   q = flat_cross(line.left, line.right, other.right);
      return (p > least && q < -least) || (p < -least && q > least);
    };
    return parts(edges_[a], edges_[b]) && parts(edges_[b], edges_[a]);
  }

  double rounding_;
  std::vector<Edge> edges_;
};

}  // namespace

bool crosses_itself(const FlatPolygon& polygon) { return Sweep(polygon).finds_crossing(); }

}  // namespace ballot
