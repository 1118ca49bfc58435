// Point queries of arrays that stay on the device: their answers are those for points of the host.
#include <cstring>

#include "engine/answer/point_queries.h"
#include "tests/cpu/shapes.h"
#include "tests/device/fixture.h"

namespace ballot {
namespace {

constexpr float kUnlimited = std::numeric_limits<float>::infinity();

class PointArrays : public DeviceTest {};

std::vector<ProbePoint> random_points(std::size_t count, float limit) {
  shapes::Random random(5);
  std::vector<ProbePoint> points;
  for (std::size_t i = 0; i < count; ++i) points.push_back({random.point(1.5f), i % 7 ? kUnlimited : limit});
  points[3].at.x = std::numeric_limits<float>::quiet_NaN();
  return points;
}

TEST_F(PointArrays, AnswersAreThoseForPointsOfTheHost) {
  const auto t = make(*gpu_, shapes::sphere(2));
  PointQueries queries(*gpu_, t->tracer->tree());
  const std::vector<ProbePoint> points = random_points(3000, 0.1f);
  const std::size_t n = points.size(), asked = n - 5;
  Buffer<ProbePoint> there(*gpu_, n, Access::Storage, "points");
  Buffer<Nearest> nearest(*gpu_, n, Access::Storage, "nearest");
  Buffer<std::uint32_t> inside(*gpu_, n, Access::Storage, "inside");
  there.upload(points);
  for (const bool exact : {false, true})
    for (const bool sides : {false, true}) {
      const PointQuery query{.exact = exact, .sides = sides};
      std::vector<Nearest> expected(n), found(n);
      std::vector<std::uint32_t> flags(n), found_flags(n, 7);
      queries.nearest(points, expected, query);
      queries.inside(points, flags, query);
      inside.upload(found_flags);
      queries.nearest({there, n}, nearest, query);
      queries.inside({there, asked}, inside, query);
      nearest.download(found), inside.download(found_flags);
      EXPECT_EQ(std::memcmp(found.data(), expected.data(), n * sizeof(Nearest)), 0);
      for (std::size_t i = 0; i < n; ++i) ASSERT_EQ(found_flags[i], i < asked ? flags[i] : 7) << i;
    }
  EXPECT_THROW(queries.nearest({there, n + 1}, nearest), Error);
  EXPECT_THROW(queries.inside({there, n + 1}, inside), Error);
  queries.nearest({there, 0}, nearest);
}

// More points than one dispatch takes. Most are beyond their limit of every triangle.
TEST_F(PointArrays, PartsFollowEachOther) {
  const auto t = make(*gpu_, shapes::box({-1, -1, -1}, {1, 1, 1}));
  PointQueries queries(*gpu_, t->tracer->tree());
  const std::size_t n = (1u << 22) + 1000;
  std::vector<ProbePoint> points(n, {{40, 40, 40}, 0.5f});
  for (const std::size_t i : {std::size_t(5), n - 999, n - 1}) points[i].at = {0, 0, i == 5 ? 0.75f : 1.25f};
  Buffer<ProbePoint> there(*gpu_, n, Access::Storage, "points");
  Buffer<std::uint32_t> inside(*gpu_, n, Access::Storage, "inside");
  there.upload(points);
  queries.inside({there, n}, inside);
  std::vector<std::uint32_t> flags(n);
  inside.download(flags);
  EXPECT_EQ(std::ranges::count(flags, 1u), 1);
  EXPECT_EQ(flags[5], 1u);
  if (n * sizeof(Nearest) > gpu_->info().max_storage_range) return;
  Buffer<Nearest> nearest(*gpu_, n, Access::Storage, "nearest");
  queries.nearest({there, n}, nearest);
  std::vector<Nearest> found(n);
  nearest.download(found);
  for (const std::size_t i : {std::size_t(5), n - 999, n - 1}) EXPECT_EQ(found[i].distance, 0.25f);
  EXPECT_EQ(std::ranges::count(found, NO_HIT, &Nearest::prim), std::ptrdiff_t(n - 3));
}

// The walk of such a point takes more steps than Mesa 22.3 lets a loop take.
TEST_F(PointArrays, WalksThatTheDriverCutsShort) {
  const auto t = make(*gpu_, shapes::identical(100000), {.builder = BuilderId::Balanced});
  PointQueries queries(*gpu_, t->tracer->tree());
  const std::vector<ProbePoint> points{{{0.25f, 0.25f, 2}, kUnlimited}, {{-1, 0, 0}, kUnlimited}};
  Buffer<ProbePoint> there(*gpu_, 2, Access::Storage, "points");
  Buffer<Nearest> nearest(*gpu_, 2, Access::Storage, "nearest");
  there.upload(points);
  queries.nearest({there, 2}, nearest, {.sides = true});
  std::vector<Nearest> found(2);
  nearest.download(found);
  EXPECT_TRUE(found[0].distance == 2 && found[1].distance == 1);
}

}  // namespace
}  // namespace ballot
