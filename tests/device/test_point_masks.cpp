// Masks of points: answers are those of the triangles that share a bit with the point's mask.
#include <algorithm>
#include <cstring>

#include "engine/answer/point_queries.h"
#include "engine/tree/host/moved_corners.h"
#include "tests/device/arrays_there.h"
#include "tests/device/builders.h"
#include "tests/device/forests.h"

namespace ballot {
namespace {

using namespace forests;

constexpr float kEndless = std::numeric_limits<float>::infinity();

using Words = std::vector<std::uint32_t>;
using Lists = std::vector<std::vector<Within>>;

class PointMasks : public Builders {
 protected:
  static std::vector<ProbePoint> points_by(const UnsetVector<Triangle>& triangles, std::size_t count) {
    shapes::Random random(83);
    std::vector<ProbePoint> points;
    while (points.size() < count) {
      const Triangle& t = triangles[random.below(triangles.size())];
      points.push_back({t[random.below(3)] + random.point(0.2f), random.below(3) ? kEndless : 0.3f});
      points.push_back({t[random.below(3)], 0.1f});
      points.push_back({random.point(9), kEndless});
    }
    return points;
  }
  static Words words(std::size_t count, std::uint32_t most) {
    shapes::Random random{std::uint32_t(count)};
    Words all(count);
    for (std::uint32_t& w : all) w = std::uint32_t(random.below(most));
    return all;
  }
  static PointQuery query(const Words& of_points, const Words& of_triangles) {
    PointQuery query;
    query.filters.of[FILTER_MASK] = [&of_points](std::uint64_t first, std::span<std::uint32_t> room) {
      std::copy_n(of_points.begin() + std::ptrdiff_t(first), room.size(), room.begin());
    };
    query.triangle_masks = of_triangles;
    return query;
  }
  static Lists within(PointQueries& queries, std::span<const ProbePoint> points, const PointQuery& query) {
    Lists all;
    InsideStream stream{.most = points.size()};
    stream.next = [points](std::uint64_t first, std::span<ProbePoint> room) {
      std::copy_n(points.begin() + std::ptrdiff_t(first), room.size(), room.begin());
      return room.size();
    };
    const auto take = [&](std::uint64_t, std::span<const std::uint32_t> counts, std::span<const Within> triangles) {
      for (const std::uint32_t n : counts) {
        all.emplace_back(triangles.begin(), triangles.begin() + n);
        triangles = triangles.subspan(n);
      }
    };
    queries.within(stream, take, query);
    return all;
  }
  /// Expects the same lists of points on the device, as it is and as a GPU in several chunks.
  static void expect_there(PointQueries& queries, std::span<const ProbePoint> points, const Words& of_points,
                           const Words& of_triangles, const Lists& truth) {
    Words counts;
    std::vector<Within> all;
    for (const auto& list : truth) {
      counts.push_back(std::uint32_t(list.size()));
      all.insert(all.end(), list.begin(), list.end());
    }
    Buffer<ProbePoint> there(*gpu_, points.size(), Access::Storage, "points");
    Buffer<std::uint32_t> masks(*gpu_, points.size(), Access::Storage, "masks");
    there.upload(points), masks.upload(of_points);
    for (const bool as_gpu : {false, true}) {
      if (as_gpu) StreamRing::of(*gpu_).act_as_gpu(512);
      ArraysThere<Within> to(*gpu_, points.size(), all.size());
      PointQuery asked;
      asked.triangle_masks = of_triangles;
      EXPECT_EQ(queries.within({there, points.size(), {{&masks}}}, to.lists(), asked).records, all.size());
      to.expect(counts, {}, all);
    }
    gpu_->stream_ring().reset();
  }
  static void check(PointQueries& queries, const UnsetVector<Triangle>& world, const char* name) {
    SCOPED_TRACE(name);
    const std::vector<ProbePoint> points = points_by(world, 1500);
    const Words of_points = words(points.size(), 4), of_triangles = words(world.size(), 4);
    Lists truth = within(queries, points, {});
    for (std::size_t i = 0; i < points.size(); ++i)
      std::erase_if(truth[i], [&](const Within& w) { return (of_triangles[w.prim] & of_points[i]) == 0; });
    const PointQuery masked = query(of_points, of_triangles);
    const Lists found = within(queries, points, masked);
    expect_there(queries, points, of_points, of_triangles, truth);
    std::vector<Nearest> nearest(points.size()), exact(points.size());
    queries.nearest(points, nearest, masked);
    PointQuery in_truth = masked;
    in_truth.exact = true;
    queries.nearest(points, exact, in_truth);
    std::size_t none = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      ASSERT_EQ(found[i].size(), truth[i].size()) << "point " << i;
      ASSERT_TRUE(truth[i].empty() ||
                  std::memcmp(found[i].data(), truth[i].data(), truth[i].size() * sizeof(Within)) == 0);
      ASSERT_EQ(nearest[i].prim, truth[i].empty() ? NO_HIT : truth[i][0].prim) << "point " << i;
      ASSERT_EQ(exact[i].prim == NO_HIT, truth[i].empty()) << "point " << i;
      none += truth[i].empty();
      if (truth[i].empty()) continue;
      ASSERT_EQ(nearest[i].distance, truth[i][0].distance) << "point " << i;
      ASSERT_NE(of_triangles[exact[i].prim] & of_points[i], 0u);
      ASSERT_NEAR(exact[i].distance, nearest[i].distance, 1e-4f) << "point " << i;
    }
    EXPECT_GT(none, points.size() / 4);
    EXPECT_LT(none, points.size() / 2);
  }
  static void check_streams(PointQueries& queries, const UnsetVector<Triangle>& world) {
    check(queries, world, "as the device does");
    gpu_->stream_ring().reset();
    StreamRing::of(*gpu_).act_as_gpu(500);
    check(queries, world, "in chunks, as a GPU would");
    gpu_->stream_ring().reset();
  }
};

TEST_F(PointMasks, LeaveOutTriangles) {
  const shapes::Triangles triangles = shapes::soup(900, 0.3f);
  const auto t = make(*gpu_, triangles, {.split_budget = 2});
  PointQueries queries(*gpu_, t->tracer->tree());
  check_streams(queries, triangles);
}

TEST_F(PointMasks, AmongInstances) {
  Forest forest = make_forest(three_meshes(), twelve_instances());
  const UnsetVector<Triangle> world = moved_triangles(forest);
  DeviceTree tree(*gpu_, forest);
  PointQueries queries(*gpu_, tree);
  check_streams(queries, world);
}

// The exact answers are those of a scene that has the visible triangles alone.
TEST_F(PointMasks, ExactAnswersAreThoseOfWhatIsVisible) {
  const shapes::Triangles all = shapes::joined(shapes::soup(300, 0.3f), shapes::sphere(2));
  Words of_triangles(all.size(), 1), prims;
  shapes::Triangles visible;
  for (std::uint32_t k = 0; k < all.size(); k += 3) {
    of_triangles[k] = 2;
    visible.push_back(all[k]), prims.push_back(k);
  }
  const std::vector<ProbePoint> points = points_by(all, 600);
  const auto whole = make(*gpu_, all), part = make(*gpu_, visible);
  PointQueries of_whole(*gpu_, whole->tracer->tree()), of_part(*gpu_, part->tracer->tree());
  const Words of_points(points.size(), 2);
  PointQuery masked = query(of_points, of_triangles);
  masked.exact = true;
  std::vector<Nearest> found(points.size()), truth(points.size());
  of_whole.nearest(points, found, masked);
  of_part.nearest(points, truth, {.exact = true});
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (truth[i].prim != NO_HIT) truth[i].prim = prims[truth[i].prim];
    ASSERT_EQ(std::memcmp(&found[i], &truth[i], sizeof(Nearest)), 0) << "point " << i;
  }
}

TEST_F(PointMasks, AreRefusedWhereTheyMeanNothing) {
  const shapes::Triangles triangles = shapes::grid(3);
  const auto t = make(*gpu_, triangles);
  PointQueries queries(*gpu_, t->tracer->tree());
  const std::vector<ProbePoint> points(80, {{0, 0, 1}, kEndless});
  std::vector<Nearest> found(points.size());
  const Words of_points(points.size(), 1), few(3, 1);
  PointQuery sides = query(of_points, {});
  sides.sides = true;
  EXPECT_THROW(queries.nearest(points, found, sides), Error);
  EXPECT_THROW(queries.nearest(points, found, query(of_points, few)), Error);
  queries.nearest(points, found, query(of_points, {}));
  EXPECT_NE(found[0].prim, NO_HIT);
}

}  // namespace
}  // namespace ballot
