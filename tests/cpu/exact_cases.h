// Scenes and rays on which rounding decides the result, and a tree that is built without Embree, as the builder refuses
// large coordinates.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "engine/tree/formats/pair.h"
#include "tests/cpu/shapes.h"

namespace ballot::exact_cases {

using shapes::Triangles;

/// A balanced tree over the triangles in their order, two per leaf. Its boxes are the tight boxes of whole triangles.
class PlainTree {
 public:
  explicit PlainTree(const Triangles& triangles) : triangles_(triangles) {
    if (triangles.empty()) return;
    bvh_.nodes.resize(2);
    for (std::uint32_t i = 0; i < triangles.size(); ++i) bvh_.references.push_back(i);
    fill(0, 0, static_cast<std::uint32_t>(triangles.size()), 0);
    bvh_.bounds = {bvh_.nodes[0].lo, bvh_.nodes[0].hi};
  }
  const Bvh& bvh() const { return bvh_; }

 private:
  void fill(std::size_t node, std::uint32_t begin, std::uint32_t end, std::uint32_t level) {
    glm::vec3 lo = triangles_[begin][0], hi = lo;
    for (std::uint32_t i = begin; i < end; ++i)
      for (const glm::vec3& v : triangles_[i]) {
        lo = glm::min(lo, v);
        hi = glm::max(hi, v);
      }
    if (end - begin <= 2) {
      bvh_.nodes[node] = {lo, hi, end - begin, begin};
      ++bvh_.stats.leaves;
      return;
    }
    const auto child = static_cast<std::uint32_t>(bvh_.nodes.size());
    bvh_.stats.depth = std::max(bvh_.stats.depth, level + 1);
    bvh_.nodes.resize(child + 2);
    bvh_.nodes[node] = {lo, hi, 0, child};
    fill(child, begin, (begin + end) / 2, level + 1);
    fill(child + 1, (begin + end) / 2, end, level + 1);
  }
  const Triangles& triangles_;
  Bvh bvh_;
};

inline Triangles transformed(Triangles triangles, float scale, const glm::vec3& offset = glm::vec3(0)) {
  for (Triangle& t : triangles)
    for (glm::vec3& v : t) v = v * scale + offset;
  return triangles;
}

inline std::vector<Ray> transformed(std::vector<Ray> rays, float scale, const glm::vec3& offset = glm::vec3(0)) {
  for (Ray& r : rays) {
    r.origin = r.origin * scale + offset;
    r.dir *= scale;
  }
  return rays;
}

/// Returns a number that is hard for floating-point arithmetic: a small integer, one ulp beside one, a denormal or huge
/// number, or a zero of either sign.
inline float awkward(shapes::Random& random) {
  const float sign = random.below(2) == 0 ? 1.f : -1.f;
  const float small = static_cast<float>(random.below(5));
  switch (random.below(8)) {
    case 0:
      return sign * small;
    case 1:
      return sign * std::nextafter(small, 9.f);
    case 2:
      return sign * std::nextafter(small, -9.f);
    case 3:
      return sign * 1e-45f * static_cast<float>(1 + random.below(4));
    case 4:
      return sign * 3e38f * random.in(0.5f, 1);
    case 5:
      return sign * random.in(0, 1) * 1e-30f;
    case 6:
      return sign * random.in(0, 1) * 1e30f;
    default:
      return random.in(-1, 1);
  }
}

inline glm::vec3 awkward_point(shapes::Random& random) {
  const float x = awkward(random), y = awkward(random), z = awkward(random);
  return {x, y, z};
}

/// Returns a ray at a point of the triangle: at a vertex, on an edge, inside, or one ulp beside such a point.
inline Ray ray_at(const Triangle& t, shapes::Random& random) {
  float a = random.in(0, 1), b = random.in(0, 1 - a);
  if (random.below(3) == 0) a = static_cast<float>(random.below(2)), b = 0;
  if (random.below(3) == 0) a = 0.5f, b = 0.5f;
  glm::vec3 at = t[0] * (1 - a - b) + t[1] * a + t[2] * b;
  if (random.below(3) == 0) {
    const auto k = static_cast<int>(random.below(3));
    at[k] = std::nextafter(at[k], random.below(2) == 0 ? -1e30f : 1e30f);
  }
  const glm::vec3 from = random.below(4) == 0 ? at : random.point(4);
  return {from, random.below(3) == 0 ? 0.f : -1e30f, at - from, random.below(3) == 0 ? 1.f : 1e30f};
}

}  // namespace ballot::exact_cases
