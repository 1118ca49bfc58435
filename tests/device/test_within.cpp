// Triangles within a radius of points: those that closest points know, one triangle at a time.
#include <algorithm>
#include <cstring>
#include <limits>

#include "engine/answer/point_queries.h"
#include "engine/oracle/closest.h"
#include "engine/oracle/nearest.h"
#include "engine/tree/host/moved_corners.h"
#include "tests/device/arrays_there.h"
#include "tests/device/builders.h"
#include "tests/device/forests.h"

namespace ballot {
namespace {

using namespace forests;

constexpr float kNoEnd = std::numeric_limits<float>::infinity(), kNan = std::numeric_limits<float>::quiet_NaN();

using Lists = std::vector<std::vector<Within>>;

class WithinRadius : public Builders {
 protected:
  static InsideStream stream_over(std::span<const ProbePoint> points) {
    InsideStream stream{.most = points.size()};
    stream.next = [points](std::uint64_t first, std::span<ProbePoint> room) {
      std::copy_n(points.begin() + std::ptrdiff_t(first), room.size(), room.begin());
      return room.size();
    };
    return stream;
  }
  static Lists listed_once(PointQueries& queries, std::span<const ProbePoint> points) {
    Lists all;
    queries.within(stream_over(points),
                   [&](std::uint64_t first, std::span<const std::uint32_t> counts, std::span<const Within> triangles) {
                     EXPECT_EQ(first, all.size());
                     for (const std::uint32_t n : counts) {
                       all.emplace_back(triangles.begin(), triangles.begin() + n);
                       triangles = triangles.subspan(n);
                     }
                     EXPECT_TRUE(triangles.empty());
                   });
    return all;
  }
  static void expect_equal(const Lists& found, const Lists& truth) {
    ASSERT_EQ(found.size(), truth.size());
    for (std::size_t i = 0; i < truth.size(); ++i) {
      ASSERT_EQ(found[i].size(), truth[i].size()) << "point " << i;
      ASSERT_TRUE(truth[i].empty() ||
                  std::memcmp(found[i].data(), truth[i].data(), truth[i].size() * sizeof(Within)) == 0)
          << "point " << i;
    }
  }
  static void expect_there(PointQueries& queries, std::span<const ProbePoint> points, const Lists& truth) {
    std::vector<std::uint32_t> counts;
    std::vector<std::int64_t> offsets{0};
    std::vector<Within> all;
    for (const auto& list : truth) {
      counts.push_back(std::uint32_t(list.size()));
      all.insert(all.end(), list.begin(), list.end());
      offsets.push_back(std::int64_t(all.size()));
    }
    Buffer<ProbePoint> there(*gpu_, points.size(), Access::Storage, "points");
    there.upload(points);
    ArraysThere<Within> to(*gpu_, points.size(), all.size() + 2);
    EXPECT_EQ(queries.within({there, points.size()}, to.lists()).records, all.size());
    to.expect(counts, offsets, all);
  }
  /// Lists as the device does, and as a GPU would in several chunks, which must be the same; and of points on the
  /// device, in both ways.
  static Lists lists(PointQueries& queries, std::span<const ProbePoint> points) {
    Lists all = listed_once(queries, points);
    gpu_->stream_ring().reset();
    StreamRing::of(*gpu_).act_as_gpu(500);
    expect_equal(listed_once(queries, points), all);
    expect_there(queries, points, all);
    gpu_->stream_ring().reset();
    expect_there(queries, points, all);
    return all;
  }
  static Lists lists(const UnsetVector<Triangle>& triangles, std::span<const ProbePoint> points,
                     const BuildSettings& settings = {}) {
    const auto t = make(*gpu_, triangles, settings);
    PointQueries queries(*gpu_, t->tracer->tree());
    return lists(queries, points);
  }
  /// Returns what each triangle's own tree tells of its distance.
  static Lists one_by_one(const UnsetVector<Triangle>& triangles, std::span<const ProbePoint> points) {
    Lists all(points.size());
    for (std::uint32_t k = 0; k < triangles.size(); ++k) {
      const auto t = make(*gpu_, UnsetVector<Triangle>{triangles[k]});
      PointQueries queries(*gpu_, t->tracer->tree());
      std::vector<Nearest> nearest(points.size());
      queries.nearest(points, nearest);
      for (std::size_t i = 0; i < points.size(); ++i)
        if (nearest[i].prim != NO_HIT) all[i].push_back({nearest[i].distance, k});
    }
    for (auto& list : all) std::ranges::sort(list, {}, [](const Within& w) { return std::pair(w.distance, w.prim); });
    return all;
  }
};

/// Points in and about triangles, at corners, on edges, and far away, with limits of many sizes.
std::vector<ProbePoint> points_by(const UnsetVector<Triangle>& triangles, std::size_t count) {
  shapes::Random random(71);
  std::vector<ProbePoint> points;
  const auto add = [&](const glm::vec3& at, float size) {
    const float limits[] = {0, 0.01f * size, size, 3 * size, kNoEnd};
    points.push_back({at, limits[random.below(5)]});
  };
  while (points.size() < count) {
    const Triangle& t = triangles[random.below(triangles.size())];
    const float size = glm::length(t[1] - t[0]) + glm::length(t[2] - t[0]);
    add(t[random.below(3)], size);
    add(0.5f * (t[0] + t[1]), size);
    add((t[0] + t[1] + t[2]) / 3.f + random.point(size), size);
    add(t[0] + random.point(1e3f), 600);
    add(t[0] + random.point(1e7f), 6e6f);
  }
  points[3].limit = -1;
  points[4].limit = kNan;
  points[5].at.z = kNan;
  points[6].limit = -0.f;
  return points;
}

TEST_F(WithinRadius, IsWhatClosestPointsKnowOfEachTriangle) {
  shapes::Triangles twice = shapes::soup(12, 0.5f);
  twice = shapes::joined(twice, twice);
  const std::pair<const char*, shapes::Triangles> cases[] = {
      {"twice", twice}, {"box", shapes::box({-1, -1, -1}, {1, 1, 1})}, {"slivers", shapes::slivers(20)}};
  for (const auto& [name, triangles] : cases) {
    SCOPED_TRACE(name);
    const std::vector<ProbePoint> points = points_by(triangles, 400);
    const Lists truth = one_by_one(triangles, points);
    expect_equal(lists(triangles, points), truth);
    std::size_t all = 0, zero = 0;
    for (const auto& list : truth) all += list.size(), zero += !list.empty() && list[0].distance == 0;
    EXPECT_GT(all, 1000u);
    EXPECT_GT(zero, 30u);
    for (const std::size_t dead : {3, 4, 5}) EXPECT_TRUE(truth[dead].empty());
  }
}

// The first is the nearest triangle, and distances are those of the exact ones within their bound.
TEST_F(WithinRadius, AgreesWithClosestPointsAndTheOracle) {
  const shapes::Triangles triangles = shapes::soup(1500, 0.2f);
  const std::vector<ProbePoint> points = points_by(triangles, 1500);
  const auto t = make(*gpu_, triangles, {.split_budget = 2});
  PointQueries queries(*gpu_, t->tracer->tree());
  const Lists found = lists(queries, points);
  std::vector<Nearest> nearest(points.size());
  queries.nearest(points, nearest);
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_EQ(found[i].empty(), nearest[i].prim == NO_HIT) << i;
    if (points[i].limit == kNoEnd && std::isfinite(points[i].at.z)) {
      ASSERT_EQ(found[i].size(), triangles.size());
    }
    const float reach = glm::length(points[i].at) + 3;
    if (!found[i].empty() && reach < 1e4f) {
      ASSERT_EQ(found[i][0].distance, nearest[i].distance) << i;
      ASSERT_EQ(found[i][0].prim, nearest[i].prim) << i;
    }
    if (i % 50 != 0 || found[i].empty()) continue;
    for (const Within& w : found[i])
      ASSERT_NEAR(w.distance, exact_distance(points[i].at, triangles[w.prim]).distance(), 64 * 0x1p-24 * 2 * reach);
  }
}

TEST_F(WithinRadius, IsTheSameForEveryBuilder) {
  const shapes::Triangles triangles = shapes::joined(shapes::soup(600, 0.3f), shapes::identical(100));
  const std::vector<ProbePoint> points = points_by(triangles, 1000);
  std::optional<Lists> first;
  for (const Builder& builder : kBuilders) {
    SCOPED_TRACE(builder.name);
    const Bvh bvh = build(triangles, {}, builder);
    DeviceTree tree(*gpu_, bvh, triangles, facts_of(bvh));
    PointQueries queries(*gpu_, tree);
    const Lists found = lists(queries, points);
    if (first) expect_equal(found, *first);
    first = found;
  }
}

// More triangles than a list takes a place for, and than Mesa 22.3 lets a loop visit.
TEST_F(WithinRadius, MayHoldMany) {
  const std::uint32_t kMany = 70000;
  const shapes::Triangles triangles = shapes::identical(kMany);
  std::vector<ProbePoint> points(40, {{0.1f, 0.1f, 1}, 0.5f});
  points[7].limit = points[39].limit = 1;
  const Lists found = lists(triangles, points, {.builder = BuilderId::Balanced});
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_EQ(found[i].size(), points[i].limit == 1 ? kMany : 0u);
    for (std::uint32_t k = 0; k < found[i].size(); ++k) ASSERT_EQ(found[i][k].prim, k);
  }
}

TEST_F(WithinRadius, AmongInstancesIsThatOfTheMovedTriangles) {
  Forest forest = make_forest(three_meshes(), twelve_instances());
  const UnsetVector<Triangle> world = moved_triangles(forest);
  std::vector<ProbePoint> points = points_by(world, 400);
  for (std::size_t i = 0; i < points.size(); ++i)
    if (points[i].limit == kNoEnd && i % 7) points[i].limit = 0.5f;
  DeviceTree tree(*gpu_, forest);
  PointQueries queries(*gpu_, tree);
  expect_equal(lists(queries, points), lists(world, points));
}

TEST_F(WithinRadius, DegenerateTrianglesAndEmptyScenes) {
  const std::vector<ProbePoint> points{{{0, 0, 0}, kNoEnd}, {{1, 2, 3}, 1}};
  expect_equal(lists({}, points), Lists(2));
  shapes::Triangles triangles = shapes::grid(2);
  const std::size_t sound = triangles.size();
  triangles.push_back({glm::vec3(0), glm::vec3(0), glm::vec3(1)});
  EXPECT_EQ(lists(triangles, points)[0].size(), sound);
  EXPECT_TRUE(lists(triangles, {}).empty());
}

TEST_F(WithinRadius, HasNoModeExact) {
  const auto t = make(*gpu_, shapes::grid(2));
  PointQueries queries(*gpu_, t->tracer->tree());
  const std::vector<ProbePoint> points(3);
  try {
    queries.within(stream_over(points), [](auto, auto, auto) {}, {.exact = true});
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("mode exact"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace ballot
