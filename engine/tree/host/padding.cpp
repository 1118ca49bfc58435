#include "engine/tree/host/padding.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>

#include "engine/core/parallel.h"

namespace ballot {

namespace {

double longest_side(const Bounds& box) {
  const glm::dvec3 sides = glm::dvec3(box.hi) - glm::dvec3(box.lo);
  return std::max({sides.x, sides.y, sides.z});
}

/// Calls work(i) for every node, on all cores.
template <class Work>
void for_each_node(std::size_t nodes, const Work& work) {
  for_chunks(nodes, 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) work(i);
  });
}

/// Returns for each node and axis the largest extent of the triangles below the node.
std::vector<glm::dvec3> sides_below(const Bvh& bvh, std::span<const Triangle> triangles) {
  std::vector<glm::dvec3> sides(bvh.nodes.size(), glm::dvec3(0));
  for_each_node(sides.size(), [&](std::size_t i) {
    const BvhNode& node = bvh.nodes[i];
    for (std::uint32_t k = 0; k < node.count; ++k) {
      const Triangle& t = triangles[bvh.references[node.first + k]];
      const glm::dvec3 lo = glm::min(t[0], glm::min(t[1], t[2])), hi = glm::max(t[0], glm::max(t[1], t[2]));
      sides[i] = glm::max(sides[i], hi - lo);
    }
  });
  for (std::size_t i = bvh.nodes.size(); i-- > 0;) {  // children come after their parents
    const BvhNode& node = bvh.nodes[i];
    if (node.count == 0 && node.first > i) sides[i] = glm::max(sides[node.first], sides[node.first + 1]);
  }
  return sides;
}

}  // namespace

float padded_reach(const Bounds& scene) {
  const double longest = longest_side(scene);
  const glm::vec3 far = glm::max(glm::abs(scene.lo), glm::abs(scene.hi));
  if (!(longest >= 0x1p-60 && longest <= 0x1p+44 && std::max({far.x, far.y, far.z}) <= 0x1p+60f)) return 0;
  return float(0x1p+21 * longest);
}

std::vector<Bounds> padded_boxes(const Bvh& bvh, std::span<const Triangle> triangles) {
  constexpr double kRounding = 1.02 * 0x1p-24;  // 2^-24, with room for products of roundings
  const std::vector<glm::dvec3> sides = sides_below(bvh, triangles);
  const double clamped = 0x1p-35 * longest_side(bvh.bounds);
  const glm::dvec3 origin = box_origin(bvh.bounds);
  std::vector<Bounds> boxes(bvh.nodes.size());
  for_each_node(boxes.size(), [&](std::size_t i) {
    const glm::dvec3 lo = glm::dvec3(bvh.nodes[i].lo) - origin, hi = glm::dvec3(bvh.nodes[i].hi) - origin;
    const glm::dvec3 centre = glm::abs(0.5 * (lo + hi)), half = 0.5 * (hi - lo);
    const double longest = std::max({sides[i].x, sides[i].y, sides[i].z});
    for (int axis = 0; axis < 3; ++axis) {
      const double moved = origin[axis] != 0 ? centre[axis] + half[axis] : 0;  // for the rounding of the ray's origin
      const double pad =
          kRounding * (18 * sides[i][axis] + 31 * longest + 2 * centre[axis] + 3 * half[axis] + moved) + clamped;
      constexpr float infinity = std::numeric_limits<float>::infinity();
      boxes[i].lo[axis] = std::nextafter(static_cast<float>(lo[axis] - pad), -infinity);
      boxes[i].hi[axis] = std::nextafter(static_cast<float>(hi[axis] + pad), infinity);
    }
  });
  return boxes;
}

}  // namespace ballot
