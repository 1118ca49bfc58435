// What tests of crossings on a device share: rays that meet edges and vertices.
#pragma once

#include <algorithm>
#include <cstring>

#include "engine/answer/query_judge.h"
#include "engine/answer/ray_queries.h"
#include "engine/oracle/nearest.h"
#include "tests/cpu/brute_crossings.h"
#include "tests/cpu/shapes.h"
#include "tests/device/fixture.h"

namespace ballot {

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
 public:
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
  static ListedCrossings listed(RayQueries& queries, std::span<const Ray> rays, const CrossingQuery& query = {}) {
    ListedCrossings all;
    for (const std::vector<Hit>& hits : lists(queries, rays, query)) {
      all.counts.push_back(std::uint32_t(hits.size()));
      all.hits.insert(all.hits.end(), hits.begin(), hits.end());
    }
    return all;
  }
  /// Expects that the first crossings are the beginnings of whole lists, bit for bit.
  static void expect_first(RayQueries& queries, std::span<const Ray> rays, const std::vector<std::vector<Hit>>& whole,
                           CrossingQuery query = {}) {
    for (const std::uint32_t most : {0u, 1u, 2u, 5u, 17u}) {
      query.most = most;
      const auto first = lists(queries, rays, query);
      for (std::size_t i = 0; i < rays.size(); ++i) {
        ASSERT_EQ(first[i].size(), std::min<std::size_t>(most, whole[i].size())) << "ray " << i << ", first " << most;
        ASSERT_TRUE(first[i].empty() ||
                    std::memcmp(first[i].data(), whole[i].data(), first[i].size() * sizeof(Hit)) == 0)
            << "ray " << i << ", first " << most;
      }
    }
  }
  static std::vector<std::uint32_t> prims_of(const std::vector<Hit>& hits) {
    std::vector<std::uint32_t> prims;
    for (const Hit& h : hits) prims.push_back(h.prim);
    return prims;
  }
};

}  // namespace ballot
