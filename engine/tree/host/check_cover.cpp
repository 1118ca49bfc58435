#include "engine/tree/host/check_cover.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace ballot {
namespace {

using Vec = glm::dvec3;
using Part = std::pair<double, double>;  // a part of a segment: first and last parameter; 0 is the start, 1 the end

bool holds(const BvhNode& box, const glm::vec3& p) {
  for (int axis = 0; axis < 3; ++axis)
    if (!(p[axis] >= box.lo[axis] && p[axis] <= box.hi[axis])) return false;
  return true;
}

// Returns the part of the segment that lies in the box, which is widened by `slack` on each side. The part is empty if
// first > second.
Part part_inside(const Vec& from, const Vec& to, const BvhNode& box, double slack) {
  Part part{0, 1};
  for (int axis = 0; axis < 3; ++axis) {
    const double lo = box.lo[axis] - slack, hi = box.hi[axis] + slack;
    const double length = to[axis] - from[axis];
    if (std::abs(length) <= slack) {  // nearly parallel to the face: all of it is inside, or none
      if (std::max(from[axis], to[axis]) < lo || std::min(from[axis], to[axis]) > hi) return {1, 0};
      continue;
    }
    const double a = (lo - from[axis]) / length, b = (hi - from[axis]) / length;
    part.first = std::max(part.first, std::min(a, b));
    part.second = std::min(part.second, std::max(a, b));
  }
  return part;
}

bool covers(const Vec& from, const Vec& to, std::span<const std::uint32_t> leaves, std::span<const BvhNode> nodes,
            double slack) {
  std::vector<Part> parts;
  for (const std::uint32_t leaf : leaves) {
    const Part part = part_inside(from, to, nodes[leaf], slack);
    if (part.first <= part.second) parts.push_back(part);
  }
  std::sort(parts.begin(), parts.end());
  constexpr double kRounding = 1e-12;
  double reach = 0;
  for (const Part& part : parts) {
    if (part.first > reach + kRounding) return false;
    reach = std::max(reach, part.second);
  }
  return !parts.empty() && reach >= 1 - kRounding;
}

}  // namespace

LeavesOfTriangles::LeavesOfTriangles(const Bvh& bvh, std::span<const std::uint32_t> owner, std::size_t triangle_count)
    : begin_(triangle_count + 1, 0) {
  const auto each = [&](const auto& use) {
    for (std::size_t i = 0; i < owner.size(); ++i)
      if (owner[i] != kNobody && bvh.references[i] < triangle_count) use(bvh.references[i], owner[i]);
  };
  each([&](std::uint32_t prim, std::uint32_t) { ++begin_[prim + 1]; });
  for (std::size_t i = 1; i < begin_.size(); ++i) begin_[i] += begin_[i - 1];
  leaves_.resize(begin_.back());
  std::vector<std::uint32_t> at(begin_.begin(), begin_.end() - 1);
  each([&](std::uint32_t prim, std::uint32_t leaf) { leaves_[at[prim]++] = leaf; });
}

std::span<const std::uint32_t> LeavesOfTriangles::of(std::size_t prim) const {
  return std::span(leaves_).subspan(begin_[prim], begin_[prim + 1] - begin_[prim]);
}

const char* uncovered(const Triangle& t, std::span<const std::uint32_t> leaves, std::span<const BvhNode> nodes) {
  constexpr std::array kVertices{"vertex 0", "vertex 1", "vertex 2"};
  double largest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto holds_vertex = [&](std::uint32_t leaf) { return holds(nodes[leaf], t[k]); };
    if (std::none_of(leaves.begin(), leaves.end(), holds_vertex)) return kVertices[k];
    for (int axis = 0; axis < 3; ++axis) largest = std::max(largest, std::abs(double{t[k][axis]}));
  }
  if (leaves.size() == 1) return nullptr;  // a box that holds the vertices holds the triangle
  const double slack = 0x1p-44 * largest;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec a(t[k]), b(t[(k + 1) % 3]), c(t[(k + 2) % 3]);
    if (!covers(a, b, leaves, nodes, slack)) return "an edge";
    if (!covers(a, (b + c) * 0.5, leaves, nodes, slack)) return "a median";
  }
  return nullptr;
}

}  // namespace ballot
