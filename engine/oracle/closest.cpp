// The distance in double precision, and its bound. It is computed as shaders/query/closest_point.comp computes it in
// float32, whose proof holds with w = 2^-53 and the normal of the triangle itself (engine/core/exact_area.h): with M
// the largest distance of the triangle's vertices from the point it is off by 48 w M, to first order. 128 w M = 2^-46 M
// are taken. float32 numbers and their products stay in range.
//
// A corner is surely the nearest if the computed parts of the edges at it say so by more than their error: those of an
// edge e are off by 5 w M |e|, and 8 w M |e| are taken. An edge is surely the nearest if the foot on it is between its
// ends by more than that, and the foot on the plane is outside of it by more than its side's error, 12 w M |n| |e|.
// Then the distance is that of the same corner or edge in every triangle of which that is known.
#include "engine/oracle/closest.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>

#include "engine/core/exact_area.h"
#include "engine/oracle/nearest.h"

namespace ballot {
namespace {

constexpr double kError = 0x1p-46;  // of M, for a distance
constexpr double kPart = 0x1p-50;   // 8 w of M |e|, for a part of an edge
constexpr double kSide = 0x1p-49;   // 16 w of M |n| |e|, for a side

struct Side {
  Side(const glm::dvec3& p, const glm::dvec3& q, const glm::dvec3& edge)
      : e(edge), at_p(-glm::dot(p, edge)), at_q(glm::dot(q, edge)), between(at_p > 0 && at_q > 0) {
    foot = (p * at_q + q * at_p) / (at_p + at_q);
  }
  glm::dvec3 e;
  double at_p, at_q;
  glm::dvec3 foot;
  bool between;
};

/// The nearest point of a triangle, relative to the point.
struct Near {
  Near(const glm::dvec3& point, const Triangle& t)
      : v{glm::dvec3(t[0]) - point, glm::dvec3(t[1]) - point, glm::dvec3(t[2]) - point},
        sides{Side(v[0], v[1], glm::dvec3(t[1]) - glm::dvec3(t[0])),
              Side(v[1], v[2], glm::dvec3(t[2]) - glm::dvec3(t[1])),
              Side(v[2], v[0], glm::dvec3(t[0]) - glm::dvec3(t[2]))},
        normal(exact_cross(t[0], t[1], t[2])) {
    for (std::size_t i = 0; i < 3; ++i) reach = std::max(reach, glm::dot(v[i], v[i]));
    reach = std::sqrt(reach);
    const double normal2 = glm::dot(normal, normal), depth = glm::dot(normal, v[0]);
    double longest = -1;
    bool beside = false;
    for (std::size_t i = 0; i < 3; ++i) {
      side[i] = glm::dot(glm::cross(normal, sides[i].e), v[i]);
      const double length = sides[i].at_p + sides[i].at_q;
      if (length > longest) longest = length, beside = sides[i].between;
    }
    inside = beside && normal2 > 0 && std::max({side[0], side[1], side[2]}) <= 0;
    double best = std::numeric_limits<double>::max();
    const auto take = [&](double square, int what) {
      if (square < best) best = square, feature = what;
    };
    for (int i = 0; i < 3; ++i) take(glm::dot(v[std::size_t(i)], v[std::size_t(i)]), i);
    for (int i = 0; i < 3; ++i) {
      const Side& s = sides[std::size_t(i)];
      if (s.between) take(glm::dot(s.foot, s.foot), 3 + i);
    }
    if (inside) take(depth * depth / normal2, 6);
    distance = std::sqrt(best);
  }

  double error() const { return kError * reach; }

  /// Returns true if the nearest point is surely the feature that it was computed to be, and that is no inner point.
  bool sure() const {
    const auto part = [&](std::size_t i) { return kPart * reach * glm::length(sides[i].e); };
    if (feature < 3) {
      const std::size_t i = std::size_t(feature), before = (i + 2) % 3;
      return sides[i].at_p < -part(i) && sides[before].at_q < -part(before);
    }
    if (feature == 6) return false;
    const std::size_t i = std::size_t(feature) - 3;
    const double n = glm::length(normal) * glm::length(sides[i].e);
    return sides[i].at_p > part(i) && sides[i].at_q > part(i) && side[i] > kSide * reach * n;
  }

  /// Returns true if the nearest point is surely inside the triangle.
  bool sure_inside() const {
    if (feature != 6) return false;
    const double n = kSide * reach * glm::length(normal);
    return std::ranges::all_of(std::array{0u, 1u, 2u},
                               [&](unsigned i) { return side[i] < -n * glm::length(sides[i].e); });
  }

  std::array<glm::dvec3, 3> v;
  std::array<Side, 3> sides;  // ab, bc, ca
  glm::dvec3 normal;
  double side[3]{}, reach = 0, distance = 0;
  bool inside = false;
  int feature = 0;  // 0 to 2: a corner; 3 to 5: an edge; 6: the inside
};

/// A triangle that may be the nearest.
struct Candidate {
  std::uint32_t prim;
  Triangle triangle;
  Near near;
};

/// Returns true if both are surely as near: as the same corner or edge, or as the same triangle.
bool same_feature(const Candidate& a, const Candidate& b) {
  if (a.triangle == b.triangle) return true;
  if (!a.near.sure() || !b.near.sure() || (a.near.feature < 3) != (b.near.feature < 3)) return false;
  const auto corner = [](const Candidate& c, int offset) {
    return c.triangle[std::size_t(c.near.feature + offset) % 3];
  };
  if (a.near.feature < 3) return corner(a, 0) == corner(b, 0);
  return (corner(a, 0) == corner(b, 0) && corner(a, 1) == corner(b, 1)) ||
         (corner(a, 0) == corner(b, 1) && corner(a, 1) == corner(b, 0));
}

ExactClosest answer_of(const glm::dvec3& point, const Candidate& c) {
  const Near& n = c.near;
  glm::dvec3 weights(0), foot;
  if (n.feature < 3) {
    weights[n.feature] = 1;
    foot = n.v[std::size_t(n.feature)];
  } else if (n.feature < 6) {
    const int i = n.feature - 3;
    const Side& s = n.sides[std::size_t(i)];
    weights[i] = s.at_q, weights[(i + 1) % 3] = s.at_p;
    foot = s.foot;
  } else {
    weights = {-n.side[1], -n.side[2], -n.side[0]};
    foot = n.normal * (glm::dot(n.normal, n.v[0]) / glm::dot(n.normal, n.normal));
  }
  weights /= weights.x + weights.y + weights.z;
  return {
      n.distance, c.prim, point + foot, weights.y, weights.z, std::uint32_t(n.feature), n.sure() || n.sure_inside()};
}

/// Collects what may be the nearest.
class Nearby {
 public:
  Nearby(const glm::vec3& point, float limit) : point_(point), at_(point), limit_(limit) {
    if (std::isfinite(limit)) most_ = double(limit) * (1 + 0x1p-40);
  }
  /// The square of the distance beyond which nothing is of interest.
  double far() const { return most_ * most_ * (1 + 0x1p-50); }

  void consider(std::uint32_t prim, const Triangle& triangle) {
    const Near near(at_, triangle);
    if (near.distance - near.error() > most_) return;
    most_ = std::min(most_, near.distance + near.error());
    found_.push_back({prim, triangle, near});
  }

  ExactClosest choose() {
    std::erase_if(found_, [&](const Candidate& c) { return c.near.distance - c.near.error() > most_; });
    if (found_.empty()) return {};
    const Candidate* best = &found_.front();
    std::optional<ExactDistance> distance;
    for (const Candidate& c : std::span(found_).subspan(1)) {
      if (same_feature(c, *best)) {
        if (c.prim < best->prim) best = &c;
        continue;
      }
      if (!distance) distance = exact_distance(point_, best->triangle);
      ExactDistance other = exact_distance(point_, c.triangle);
      const auto order = other <=> *distance;
      if (order > 0 || (order == 0 && c.prim > best->prim)) continue;
      best = &c, distance = std::move(other);
    }
    return within(*best, distance) ? answer_of(at_, *best) : ExactClosest{};
  }

 private:
  bool within(const Candidate& c, std::optional<ExactDistance>& distance) const {
    if (!std::isfinite(limit_) || c.near.distance + c.near.error() <= double(limit_)) return true;
    if (!distance) distance = exact_distance(point_, c.triangle);
    const Dyadic limit(limit_);
    return distance->above <= limit * limit * distance->below;
  }

  glm::vec3 point_;
  glm::dvec3 at_;
  float limit_;
  double most_ = 1e300;  // an upper bound of the distance of the nearest triangle, or of the limit
  std::vector<Candidate> found_;
};

}  // namespace

ExactClosest ExactClosestPoints::nearest(const glm::vec3& point, float limit,
                                         const std::pair<std::uint32_t, Triangle>* near,
                                         const std::function<bool(std::uint32_t prim)>& keep) const {
  if (!std::isfinite(point.x) || !std::isfinite(point.y) || !std::isfinite(point.z) || !(limit >= 0)) return {};
  Nearby nearby(point, limit);
  if (near) nearby.consider(near->first, near->second);
  double far = nearby.far();
  scene_.for_each_near(point, far, [&](std::uint32_t prim, const Triangle& triangle) {
    if (keep && !keep(prim)) return;
    nearby.consider(prim, triangle);
    far = nearby.far();
  });
  return nearby.choose();
}

}  // namespace ballot
