#include "engine/scene/polygon.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <numeric>
#include <utility>

namespace ballot {
namespace {

/// The most corners for ear clipping, which takes up to the square of the number of corners in steps. Larger polygons
/// are cut as fans.
constexpr std::size_t kMaxClipped = 512;

using Points = std::vector<glm::dvec2>;

/// Projects the polygon along the dominant axis of its normal (Newell's), so that it is counter-clockwise.
Points flattened(std::span<const glm::vec3> polygon) {
  glm::dvec3 normal{0};
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const glm::dvec3 a{polygon[i]}, b{polygon[(i + 1) % polygon.size()]};
    normal += glm::dvec3{(a.y - b.y) * (a.z + b.z), (a.z - b.z) * (a.x + b.x), (a.x - b.x) * (a.y + b.y)};
  }
  const glm::dvec3 size = glm::abs(normal);
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  const double turn = normal[axis] < 0 ? -1 : 1;
  Points points;
  for (const glm::vec3& p : polygon) points.emplace_back(turn * static_cast<double>(p[u]), p[v]);
  return points;
}

double cross(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

bool is_convex(const Points& points) {
  const std::size_t n = points.size();
  for (std::size_t i = 0; i < n; ++i)
    if (cross(points[i], points[(i + 1) % n], points[(i + 2) % n]) < 0) return false;
  return true;
}

/// Cuts ears off a polygon, each time the first ear among the corners that are left.
class EarClipper {
 public:
  explicit EarClipper(const Points& points) : points_(points), left_(points.size()), tests_(points.size()) {
    std::iota(left_.begin(), left_.end(), 0u);
  }

  /// Appends the ears. Returns the corners that are left: three, or more if the polygon crosses itself or has no area.
  std::vector<std::uint32_t> clip(std::vector<std::array<std::uint32_t, 3>>& triangles) && {
    while (left_.size() > 3) {
      const std::size_t n = left_.size();
      std::size_t ear = 0;
      while (ear < n && !is_ear(ear)) ++ear;
      if (ear == n) break;
      triangles.push_back(triangle_at(ear));
      left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(ear));
    }
    return std::move(left_);
  }

 private:
  /// What is known about a corner's triangle: it turns the wrong way, or no corner before `seen` is inside.
  struct Test {
    std::array<std::uint32_t, 3> triangle{};
    bool concave = false;
    std::uint32_t seen = 0;
  };

  std::array<std::uint32_t, 3> triangle_at(std::size_t i) const {
    const std::size_t n = left_.size();
    return {left_[(i + n - 1) % n], left_[i], left_[(i + 1) % n]};
  }

  bool contains(const std::array<std::uint32_t, 3>& triangle, std::uint32_t p) const {
    const glm::dvec2 &a = points_[triangle[0]], &b = points_[triangle[1]], &c = points_[triangle[2]], &q = points_[p];
    if (q == a || q == b || q == c) return false;
    return cross(a, b, q) >= 0 && cross(b, c, q) >= 0 && cross(c, a, q) >= 0;
  }

  /// Returns true if the remaining corner i is convex and its triangle contains no other corner. While the triangle
  /// stays the same, the search for a corner inside goes on where it ended: corners disappear, but never come back.
  /// This bounds all searches of a polygon by the square of its corners.
  bool is_ear(std::size_t i) {
    const std::array<std::uint32_t, 3> triangle = triangle_at(i);
    Test& test = tests_[left_[i]];
    if (test.triangle != triangle)
      test = {triangle, cross(points_[triangle[0]], points_[triangle[1]], points_[triangle[2]]) <= 0, 0};
    if (test.concave) return false;
    for (auto at = std::ranges::lower_bound(left_, test.seen); at != left_.end(); ++at) {
      test.seen = *at;
      if (contains(triangle, *at)) return false;
    }
    return true;
  }

  const Points& points_;
  std::vector<std::uint32_t> left_;  // ascending
  std::vector<Test> tests_;          // by corner
};

}  // namespace

void triangulate(std::span<const glm::vec3> polygon, std::vector<std::array<std::uint32_t, 3>>& triangles) {
  std::vector<std::uint32_t> left(polygon.size());
  std::iota(left.begin(), left.end(), 0u);
  if (polygon.size() > 3 && polygon.size() <= kMaxClipped) {
    const Points points = flattened(polygon);
    if (!is_convex(points)) left = EarClipper(points).clip(triangles);
  }
  for (std::size_t i = 2; i < left.size(); ++i) triangles.push_back({left[0], left[i - 1], left[i]});
}

}  // namespace ballot
