// Closest points of blocks: the walk in which the lanes of a subgroup vote, and the order that puts near points
// together. The answers have the bits of points that are asked one by one.
#include <algorithm>
#include <cstring>

#include "engine/answer/point_queries.h"
#include "tests/device/arrays_there.h"
#include "tests/device/fixture.h"
#include "tests/device/forests.h"

namespace ballot {
namespace {

using namespace forests;

constexpr float kNoLimit = std::numeric_limits<float>::infinity(), kNan = std::numeric_limits<float>::quiet_NaN();

class PointBlocks : public DeviceTest {
 protected:
  using Points = std::vector<ProbePoint>;

  /// Points of a grid, x fastest.
  static Points grid(int side, float reach) {
    Points points;
    for (int i = 0; i < side * side * side; ++i) {
      const glm::ivec3 at{i % side, i / side % side, i / side / side};
      points.push_back({reach * (2.f * glm::vec3(at) / float(side - 1) - 1.f), kNoLimit});
    }
    return points;
  }
  /// Points at random, some with a limit, some dead.
  static Points scattered(std::size_t count, float reach) {
    shapes::Random random{std::uint32_t(count)};
    Points points;
    for (std::size_t i = 0; i < count; ++i)
      points.push_back({random.point(reach), i % 5 ? kNoLimit : i % 3 ? 0.2f : -1.f});
    for (std::size_t i = 7; i < count; i += 97) points[i].at.y = i % 2 ? kNan : kNoLimit;
    return points;
  }
  static std::vector<Points> sets(float reach) {
    return {grid(24, reach),
            scattered(12000, reach),
            scattered(2500, reach),
            scattered(31, reach),
            Points(3000, {{0.1f, 0.2f, 0.3f}, kNoLimit}),
            Points(2100, {{kNan, 0, 0}, kNoLimit})};
  }
  static void expect_equal(DeviceTree& tree, std::span<const Points> sets, const PointQuery& query) {
    PointQueries alone(*gpu_, tree, false), blocks(*gpu_, tree, true);
    for (const Points& points : sets) {
      std::vector<Nearest> expected(points.size()), found(points.size());
      alone.nearest(points, expected, query);
      blocks.nearest(points, found, query);
      ASSERT_EQ(std::memcmp(found.data(), expected.data(), points.size() * sizeof(Nearest)), 0) << points.size();
    }
  }
};

TEST_F(PointBlocks, AnswersAreThoseOfPointsAlone) {
  const auto ball = make(*gpu_, shapes::sphere(4)), soup = make(*gpu_, shapes::soup(3000, 0.1f)),
             none = make(*gpu_, {});
  for (const bool sides : {false, true}) {
    expect_equal(ball->tracer->tree(), sets(1.5f), {.sides = sides});
    expect_equal(soup->tracer->tree(), sets(1.2f), {.sides = sides});
  }
  expect_equal(none->tracer->tree(), sets(1), {});
}

TEST_F(PointBlocks, OfInstances) {
  Forest forest = make_forest(three_meshes(), twelve_instances());
  DeviceTree tree(*gpu_, forest);
  expect_equal(tree, sets(5), {});
}

TEST_F(PointBlocks, WithMasks) {
  const auto t = make(*gpu_, shapes::soup(3000, 0.1f));
  std::vector<std::uint32_t> of_triangles(3000);
  for (std::uint32_t i = 0; i < 3000; ++i) of_triangles[i] = 1u << i % 3;
  PointQuery query{.triangle_masks = of_triangles};
  query.filters.of[FILTER_MASK] = [](std::uint64_t first, std::span<std::uint32_t> room) {
    for (std::size_t i = 0; i < room.size(); ++i) room[i] = std::uint32_t(first + i) * 7u % 8u;
  };
  expect_equal(t->tracer->tree(), sets(1.2f), query);
}

// Parts of an array on the device, each with an order of its own.
TEST_F(PointBlocks, OfArraysOnTheDevice) {
  const auto t = make(*gpu_, shapes::sphere(3));
  PointQueries alone(*gpu_, t->tracer->tree(), false), blocks(*gpu_, t->tracer->tree(), true);
  const Points points = scattered(20000, 2);
  Buffer<ProbePoint> there(*gpu_, points.size(), Access::Storage, "points");
  Buffer<Nearest> answers(*gpu_, points.size(), Access::Storage, "answers");
  there.upload(points);
  std::vector<Nearest> expected(points.size()), found(points.size());
  alone.nearest(points, expected);
  for (const std::size_t count : {points.size(), points.size() - 3000}) {
    blocks.nearest({there, count}, answers);
    answers.download(found);
    ASSERT_EQ(std::memcmp(found.data(), expected.data(), count * sizeof(Nearest)), 0);
  }
}

// The walk takes more steps than Mesa 22.3 lets a loop take.
TEST_F(PointBlocks, WalksThatTheDriverCutsShort) {
  const auto t = make(*gpu_, shapes::identical(100000), {.builder = BuilderId::Balanced});
  const std::vector<Points> two{{{{0.25f, 0.25f, 2}, kNoLimit}, {{-1, 0, 0}, kNoLimit}}};
  expect_equal(t->tracer->tree(), two, {});
}

}  // namespace
}  // namespace ballot
