// What tests of crossings on a device share: rays that meet edges and vertices.
#pragma once

#include <algorithm>
#include <cstring>
#include <limits>

#include "engine/answer/query_judge.h"
#include "engine/answer/ray_queries.h"
#include "engine/answer/stream.h"
#include "engine/oracle/nearest.h"
#include "tests/cpu/brute_crossings.h"
#include "tests/cpu/shapes.h"
#include "tests/device/arrays_there.h"
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
      source.filters.of[FILTER_MASK] = [masks](std::uint64_t first, std::span<std::uint32_t> room) {
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
  /// Lists crossings as the device does, and as a GPU would in several chunks, which must be the same; and of rays on
  /// the device, in both ways.
  static std::vector<std::vector<Hit>> lists(RayQueries& queries, const RaySource& source,
                                             const CrossingQuery& query = {}) {
    const auto all = listed_once(queries, source, query);
    std::shared_ptr<StreamRing>& ring = queries.context().stream_ring();
    ring.reset();
    StreamRing::of(queries.context()).act_as_gpu(700);
    const auto again = listed_once(queries, source, query);
    expect_there(queries, source, query, all);
    ring.reset();
    expect_there(queries, source, query, all);
    EXPECT_EQ(again.size(), all.size());
    for (std::size_t i = 0; i < std::min(all.size(), again.size()); ++i) {
      EXPECT_EQ(again[i].size(), all[i].size()) << "ray " << i;
      if (all[i].empty() || again[i].size() != all[i].size()) continue;
      EXPECT_EQ(std::memcmp(all[i].data(), again[i].data(), all[i].size() * sizeof(Hit)), 0) << "ray " << i;
    }
    return all;
  }
  static std::vector<std::vector<Hit>> listed_once(RayQueries& queries, const RaySource& source,
                                                   const CrossingQuery& query) {
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
  /// Expects these lists, their counts and offsets, and their rows of first hits, of rays on the device.
  static void expect_there(RayQueries& queries, const RaySource& source, const CrossingQuery& query,
                           const std::vector<std::vector<Hit>>& truth) {
    const RaysThere there(queries.context(), source);
    ListedCrossings all;
    std::vector<std::int64_t> offsets{0};
    for (const std::vector<Hit>& hits : truth) {
      all.counts.push_back(std::uint32_t(hits.size()));
      all.hits.insert(all.hits.end(), hits.begin(), hits.end());
      offsets.push_back(std::int64_t(all.hits.size()));
    }
    ArraysThere<Hit> to(queries.context(), truth.size(), all.hits.size() + 3);
    EXPECT_EQ(queries.list(there.rays(), to.lists(), query).records, all.hits.size());
    to.expect(all.counts, offsets, all.hits);
    if (query.most == kAllHits) {
      queries.count(there.rays(), to.counts, query);
      to.expect(all.counts, offsets, all.hits);
    }
    if (query.most == 0 || query.most == kAllHits) return;
    std::vector<Hit> rows(truth.size() * query.most, {std::numeric_limits<float>::infinity(), NO_HIT, 0, 0});
    for (std::size_t i = 0; i < truth.size(); ++i)
      std::ranges::copy(truth[i], rows.begin() + std::ptrdiff_t(i * query.most));
    ArraysThere<Hit> first(queries.context(), 0, rows.size());
    queries.first(there.rays(), query.most, first.records, query);
    first.expect({}, {}, rows);
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
  /// Returns the first crossings of each ray, `most` for each.
  static std::vector<Hit> first(RayQueries& queries, const RaySource& source, std::uint32_t most,
                                const CrossingQuery& query = {}) {
    std::vector<Hit> all;
    const auto take = [&](std::uint64_t first, std::span<const Hit> hits) {
      EXPECT_EQ(first * most, all.size());
      all.insert(all.end(), hits.begin(), hits.end());
    };
    queries.first(source, most, take, query);
    return all;
  }
  /// Expects that the first crossings are the beginnings of whole lists, bit for bit, and misses behind them.
  static void expect_first(RayQueries& queries, const RaySource& source, const std::vector<std::vector<Hit>>& whole,
                           CrossingQuery query = {}) {
    const Hit miss{std::numeric_limits<float>::infinity(), NO_HIT, 0, 0};
    for (const std::uint32_t most : {0u, 1u, 2u, 5u, 17u}) {
      query.most = most;
      const auto listed = lists(queries, source, query);
      const auto rows = most ? first(queries, source, most, query) : std::vector<Hit>();
      ASSERT_EQ(rows.size(), whole.size() * most);
      for (std::size_t i = 0; i < whole.size(); ++i) {
        std::vector<Hit> truth(whole[i].begin(),
                               whole[i].begin() + std::min<std::ptrdiff_t>(most, std::ssize(whole[i])));
        ASSERT_EQ(listed[i].size(), truth.size()) << "ray " << i << ", first " << most;
        ASSERT_TRUE(truth.empty() || std::memcmp(listed[i].data(), truth.data(), truth.size() * sizeof(Hit)) == 0)
            << "ray " << i << ", first " << most;
        truth.resize(most, miss);
        ASSERT_TRUE(most == 0 || std::memcmp(&rows[i * most], truth.data(), most * sizeof(Hit)) == 0)
            << "ray " << i << ", row of " << most;
      }
    }
    expect_any(queries, source, whole, query);
  }
  static void expect_first(RayQueries& queries, std::span<const Ray> rays, const std::vector<std::vector<Hit>>& whole,
                           CrossingQuery query = {}) {
    expect_first(queries, source_of(rays), whole, query);
  }
  /// Expects that any crossing is one of the whole list, and none if there is none.
  static void expect_any(RayQueries& queries, const RaySource& source, const std::vector<std::vector<Hit>>& whole,
                         CrossingQuery query) {
    query.any = true;
    const std::vector<Hit> any = first(queries, source, 1, query);
    for (std::size_t i = 0; i < whole.size(); ++i) {
      const auto same = [&](const Hit& h) { return std::memcmp(&h, &any[i], sizeof(Hit)) == 0; };
      ASSERT_TRUE(whole[i].empty() ? any[i].prim == NO_HIT : std::ranges::any_of(whole[i], same)) << "ray " << i;
    }
  }
  static std::vector<std::uint32_t> prims_of(const std::vector<Hit>& hits) {
    std::vector<std::uint32_t> prims;
    for (const Hit& h : hits) prims.push_back(h.prim);
    return prims;
  }
};

}  // namespace ballot
