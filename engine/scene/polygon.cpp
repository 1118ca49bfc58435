#include "engine/scene/polygon.h"

#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <numeric>

namespace ballot {
namespace {

/// The most corners for ear clipping, which takes up to the cube of the number of corners in steps. Larger polygons are
/// cut as fans.
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

/// Returns true if the remaining corner i is convex and its triangle contains no other corner.
bool is_ear(const Points& points, const std::vector<std::uint32_t>& left, std::size_t i) {
  const std::size_t n = left.size();
  const std::uint32_t a = left[(i + n - 1) % n], b = left[i], c = left[(i + 1) % n];
  if (cross(points[a], points[b], points[c]) <= 0) return false;
  for (const std::uint32_t p : left) {
    if (p == a || p == b || p == c || points[p] == points[a] || points[p] == points[b] || points[p] == points[c])
      continue;
    if (cross(points[a], points[b], points[p]) >= 0 && cross(points[b], points[c], points[p]) >= 0 &&
        cross(points[c], points[a], points[p]) >= 0)
      return false;
  }
  return true;
}

}  // namespace

void triangulate(std::span<const glm::vec3> polygon, std::vector<std::array<std::uint32_t, 3>>& triangles) {
  std::vector<std::uint32_t> left(polygon.size());
  std::iota(left.begin(), left.end(), 0u);
  if (polygon.size() > 3 && polygon.size() <= kMaxClipped) {
    const Points points = flattened(polygon);
    if (!is_convex(points)) {
      while (left.size() > 3) {
        const std::size_t n = left.size();
        std::size_t ear = 0;
        while (ear < n && !is_ear(points, left, ear)) ++ear;
        if (ear == n) break;  // the polygon crosses itself or has no area: the rest becomes a fan
        triangles.push_back({left[(ear + n - 1) % n], left[ear], left[(ear + 1) % n]});
        left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
      }
    }
  }
  for (std::size_t i = 2; i < left.size(); ++i) triangles.push_back({left[0], left[i - 1], left[i]});
}

}  // namespace ballot
