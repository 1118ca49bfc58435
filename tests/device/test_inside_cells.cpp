// Inside tests by look-up: cells that no triangle touches. The answers have the bits of walks.
#include <algorithm>

#include "engine/answer/point_queries.h"
#include "tests/device/arrays_there.h"
#include "tests/device/fixture.h"
#include "tests/device/forests.h"

namespace ballot {
namespace {

using namespace forests;

constexpr float kAnywhere = std::numeric_limits<float>::infinity();

class InsideByCells : public DeviceTest {
 protected:
  using Points = std::vector<ProbePoint>;

  /// Points of a grid and at random in and about the bounds, on vertices and an ulp beside them, far away, and dead.
  static Points points_about(const shapes::Triangles& triangles) {
    const Bounds b = bounds_of_vertices(triangles, "points");
    const glm::vec3 middle = 0.5f * b.lo + 0.5f * b.hi, half = 0.5f * (b.hi - b.lo);
    const float reach = 1.2f * std::max({half.x, half.y, half.z});
    Points points;
    constexpr int kSide = 40;
    for (int i = 0; i < kSide * kSide * kSide; ++i) {
      const glm::ivec3 at{i % kSide, i / kSide % kSide, i / kSide / kSide};
      points.push_back({middle + reach * (2.f * glm::vec3(at) / float(kSide - 1) - 1.f), kAnywhere});
    }
    shapes::Random random(5);
    for (int i = 0; i < 60000; ++i) points.push_back({middle + random.point(reach), kAnywhere});
    for (int i = 0; i < 4000; ++i) points.push_back({middle + random.point(20 * reach), kAnywhere});
    for (int i = 0; i < 8000; ++i) {
      const Triangle& t = triangles[random.below(triangles.size())];
      const glm::vec3 v = t[random.below(3)];
      points.push_back({v, kAnywhere});
      points.push_back({{std::nextafter(v.x, 9.f), std::nextafter(v.y, -9.f), v.z}, kAnywhere});
      points.push_back({{random.point(reach).x, v.y, v.z}, kAnywhere});
      points.push_back({0.5f * (v + t[random.below(3)]), kAnywhere});
      points.push_back({v + random.point(0.01f * reach), kAnywhere});
    }
    for (const float x : {NAN, INFINITY, 1e-38f, 1e-44f, 1e-25f, 3e38f, -0.f})
      for (int k = 0; k < 3; ++k) points.push_back({middle, kAnywhere}), points.back().at[k] = x;
    return points;
  }

  enum class Cells { Used, NotUsed, Perhaps };  // Perhaps: open edges may shadow too much

  static void expect_equal(const shapes::Triangles& triangles, Cells expects = Cells::Used, bool exact = false) {
    const auto t = make(*gpu_, triangles, {.builder = BuilderId::Balanced});
    const Points points = points_about(triangles);
    PointQueries walks(*gpu_, t->tracer->tree()), cells(*gpu_, t->tracer->tree());
    walks.set_cells_pay(false);
    cells.set_cells_pay(true);
    std::vector<std::uint32_t> expected(points.size()), found(points.size(), 7);
    walks.inside(points, expected, {.exact = exact});
    cells.inside(points, found, {.exact = exact});
    EXPECT_TRUE(expects == Cells::Perhaps || cells.has_cells() == (expects == Cells::Used));
    const auto differs = std::ranges::mismatch(expected, found);
    ASSERT_TRUE(differs.in1 == expected.end())
        << "point " << differs.in1 - expected.begin() << ": " << *differs.in1 << " and " << *differs.in2;
  }
};

shapes::Triangles bumps(int levels) {
  shapes::Triangles t = shapes::sphere(levels);
  for (Triangle& triangle : t)
    for (glm::vec3& v : triangle) v *= 1 + 0.3f * std::sin(7 * v.x) * std::sin(9 * v.y + 2) * std::cos(8 * v.z);
  return t;
}

shapes::Triangles with_holes(shapes::Triangles t) {
  t.erase(t.begin() + 3, t.begin() + 9);
  t.erase(t.end() - 20, t.end() - 19);
  return t;
}

TEST_F(InsideByCells, OfClosedMeshes) {
  expect_equal(bumps(4));
  expect_equal(shapes::joined(shapes::box({-1, -1, -1}, {1, 1, 1}), shapes::box({-0.5f, -1, -0.25f}, {0.5f, 0, 1})));
  expect_equal(shapes::moved(bumps(3), {300, -700, 20}));
}

TEST_F(InsideByCells, OfOpenMeshes) {
  expect_equal(with_holes(bumps(4)));
  expect_equal(shapes::grid(9));
  expect_equal(shapes::soup(40, 0.3f));
}

TEST_F(InsideByCells, OfHardMeshes) {
  expect_equal(shapes::huge_and_tiny(200), Cells::Perhaps);
  expect_equal(shapes::slivers(100), Cells::Perhaps);
  expect_equal(shapes::identical(3), Cells::Perhaps);
  expect_equal(shapes::moved(bumps(3), {1e5f, 0, 0}), Cells::NotUsed);
  expect_equal(shapes::scaled(bumps(3), 1e-30f), Cells::NotUsed);
  shapes::Triangles flat = bumps(3);
  for (Triangle& t : flat)
    for (glm::vec3& v : t) v.y *= 1e-4f;
  expect_equal(flat);
}

TEST_F(InsideByCells, Exactly) {
  if (!gpu_->info().float64) GTEST_SKIP() << "the device has no float64";
  expect_equal(bumps(3), Cells::Used, true);
  expect_equal(with_holes(bumps(3)), Cells::Used, true);
}

// Instances are walked for; points of arrays on the device have the same answers, part by part.
TEST_F(InsideByCells, OfInstancesAndArraysOnTheDevice) {
  Forest forest = make_forest(three_meshes(), twelve_instances());
  DeviceTree tree(*gpu_, forest);
  const auto ball = make(*gpu_, bumps(3));
  const Points points = points_about(bumps(3));
  Buffer<ProbePoint> there(*gpu_, points.size(), Access::Storage, "points");
  Buffer<std::uint32_t> answers(*gpu_, points.size(), Access::Storage, "answers");
  there.upload(points);
  for (DeviceTree* of : {&tree, &ball->tracer->tree()}) {
    PointQueries walks(*gpu_, *of), cells(*gpu_, *of);
    walks.set_cells_pay(false);
    cells.set_cells_pay(true);
    std::vector<std::uint32_t> expected(points.size()), found(points.size());
    walks.inside(points, expected);
    cells.inside({there, points.size()}, answers);
    answers.download(found);
    EXPECT_EQ(expected, found);
  }
}

// The walk takes more steps than Mesa 22.3 lets a loop take.
TEST_F(InsideByCells, WalksThatTheDriverCutsShort) {
  const auto t = make(*gpu_, shapes::identical(60000), {.builder = BuilderId::Balanced});
  PointQueries walks(*gpu_, t->tracer->tree()), cells(*gpu_, t->tracer->tree());
  walks.set_cells_pay(false);
  cells.set_cells_pay(true);
  const Points points{{{0.25f, 0.25f, 2}, kAnywhere}, {{-1, 0.25f, 0}, kAnywhere}, {{-1, 0.25f, 1e-4f}, kAnywhere}};
  std::vector<std::uint32_t> expected(points.size()), found(points.size(), 7);
  walks.inside(points, expected);
  cells.inside(points, found);
  EXPECT_EQ(expected, found);
}

// Cells are found anew when a tree has changed.
TEST_F(InsideByCells, FollowTheTree) {
  const auto t = make(*gpu_, bumps(3));
  const auto other = shapes::moved(bumps(3), {0.5f, 0, 0});
  const Points points = points_about(other);
  PointQueries cells(*gpu_, t->tracer->tree());
  cells.set_cells_pay(true);
  std::vector<std::uint32_t> expected(points.size()), found(points.size());
  cells.inside(points, found);
  const Bvh bvh = build_bvh(other, quick());
  t->tracer->tree().replace(bvh, other, facts_of(bvh));
  cells.inside(points, found);
  PointQueries walks(*gpu_, t->tracer->tree());
  walks.set_cells_pay(false);
  walks.inside(points, expected);
  EXPECT_EQ(expected, found);
}

}  // namespace
}  // namespace ballot
