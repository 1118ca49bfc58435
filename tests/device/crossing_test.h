// What tests of crossings share: the exact answers by brute force, and rays that meet edges and vertices.
#pragma once

#include <algorithm>

#include "engine/oracle/nearest.h"
#include "engine/query/ray_queries.h"
#include "tests/cpu/shapes.h"
#include "tests/device/fixture.h"

namespace ballot {

/// Returns the exact crossings of a ray, in order. way: -1 those from the front alone, 1 those from the back, 0 all.
inline std::vector<std::uint32_t> crossings_of(const Ray& ray, const shapes::Triangles& triangles, int way = 0) {
  std::vector<std::pair<ExactSight, std::uint32_t>> found;
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    const ExactSight sight(ray, triangles[i]);
    if (!exact_crosses(ray, triangles[i], sight) || !sight.within(ray)) continue;
    if (way == 0 || sight.det.sign() == way) found.emplace_back(sight, i);
  }
  std::ranges::stable_sort(found, [](const auto& a, const auto& b) { return compare_t(a.first, b.first) < 0; });
  std::vector<std::uint32_t> prims;
  for (const auto& [sight, prim] : found) prims.push_back(prim);
  return prims;
}

/// Returns rays of small integers along axes and diagonals, through the points of a lattice.
inline std::vector<Ray> lattice_rays(int size) {
  std::vector<Ray> rays;
  for (int a = -1; a <= size + 1; ++a)
    for (int b = -1; b <= size + 1; ++b)
      for (int axis = 0; axis < 3; ++axis)
        for (int way = 0; way < 6; ++way) {
          Ray r{glm::vec3(0), 0, glm::vec3(0), 1e6f};
          const float sign = way % 2 ? -1.f : 1.f;
          r.dir[axis] = sign;
          if (way >= 2) r.dir[(axis + 1) % 3] = way >= 4 ? 0.5f : -1.f;
          r.origin[axis] = -sign * 16;
          r.origin[(axis + 1) % 3] = float(a) - 16 * r.dir[(axis + 1) % 3];
          r.origin[(axis + 2) % 3] = float(b);
          rays.push_back(r);
        }
  return rays;
}

class CrossingTest : public DeviceTest {
 protected:
  Context gpu_{options()};

  static RaySource source_of(std::span<const Ray> rays, std::span<const std::uint32_t> masks = {}) {
    RaySource source;
    source.count = rays.size();
    source.read = [rays](std::uint64_t first, std::span<Ray> room) {
      std::copy_n(rays.begin() + std::ptrdiff_t(first), room.size(), room.begin());
    };
    if (!masks.empty())
      source.masks = [masks](std::uint64_t first, std::span<std::uint32_t> room) {
        std::copy_n(masks.begin() + std::ptrdiff_t(first), room.size(), room.begin());
      };
    return source;
  }
  static std::vector<std::uint32_t> counts(RayQueries& queries, const RaySource& source,
                                           const CrossingQuery& query = {}) {
    std::vector<std::uint32_t> all;
    const auto take = [&](std::uint64_t first, std::span<const std::uint32_t> some) {
      EXPECT_EQ(first, all.size());
      all.insert(all.end(), some.begin(), some.end());
    };
    queries.count(source, take, query);
    return all;
  }
  static std::vector<std::uint32_t> counts(RayQueries& queries, std::span<const Ray> rays,
                                           const CrossingQuery& query = {}) {
    return counts(queries, source_of(rays), query);
  }
  static std::vector<std::vector<Hit>> lists(RayQueries& queries, const RaySource& source,
                                             const CrossingQuery& query = {}) {
    std::vector<std::vector<Hit>> all;
    const auto take = [&](std::uint64_t first, std::span<const std::uint32_t> some, std::span<const Hit> hits) {
      EXPECT_EQ(first, all.size());
      for (const std::uint32_t n : some) {
        all.emplace_back(hits.begin(), hits.begin() + n);
        hits = hits.subspan(n);
      }
      EXPECT_TRUE(hits.empty());
    };
    queries.list(source, take, query);
    return all;
  }
  static std::vector<std::vector<Hit>> lists(RayQueries& queries, std::span<const Ray> rays,
                                             const CrossingQuery& query = {}) {
    return lists(queries, source_of(rays), query);
  }
  static std::vector<std::uint32_t> prims_of(const std::vector<Hit>& hits) {
    std::vector<std::uint32_t> prims;
    for (const Hit& h : hits) prims.push_back(h.prim);
    return prims;
  }
};

}  // namespace ballot
