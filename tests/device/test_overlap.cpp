// Triangles that overlap boxes: those that exact arithmetic finds, one triangle at a time.
#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/answer/point_queries.h"
#include "engine/oracle/overlap.h"
#include "engine/tree/host/moved_corners.h"
#include "tests/device/builders.h"
#include "tests/device/forests.h"

namespace ballot {
namespace {

using namespace forests;

using Prims = std::vector<std::vector<std::uint32_t>>;

class Overlap : public Builders {
 protected:
  static Prims listed_once(PointQueries& queries, std::span<const ProbeBox> boxes, const PointQuery& query) {
    Prims all;
    BoxStream stream{.most = boxes.size()};
    stream.next = [boxes](std::uint64_t first, std::span<ProbeBox> room) {
      std::copy_n(boxes.begin() + std::ptrdiff_t(first), room.size(), room.begin());
      return room.size();
    };
    const auto take = [&](std::uint64_t first, std::span<const std::uint32_t> counts, std::span<const Within> found) {
      EXPECT_EQ(first, all.size());
      for (const std::uint32_t n : counts) {
        all.emplace_back();
        for (const Within& w : found.first(n)) {
          EXPECT_EQ(w.distance, 0);
          all.back().push_back(w.prim);
        }
        found = found.subspan(n);
      }
      EXPECT_TRUE(found.empty());
    };
    queries.overlapping(stream, take, query);
    return all;
  }
  /// Lists as the device does, and as a GPU would in several chunks, which must be the same.
  static Prims lists(PointQueries& queries, std::span<const ProbeBox> boxes, const PointQuery& query = {}) {
    const Prims all = listed_once(queries, boxes, query);
    gpu_->stream_ring().reset();
    StreamRing::of(*gpu_).act_as_gpu(500);
    EXPECT_EQ(listed_once(queries, boxes, query), all);
    gpu_->stream_ring().reset();
    return all;
  }
  static Prims lists(const UnsetVector<Triangle>& triangles, std::span<const ProbeBox> boxes,
                     const BuildSettings& settings = {}) {
    const auto t = make(*gpu_, triangles, settings);
    PointQueries queries(*gpu_, t->tracer->tree());
    return lists(queries, boxes);
  }
  static Prims one_by_one(std::span<const Triangle> triangles, std::span<const ProbeBox> boxes) {
    Prims all(boxes.size());
    for (std::size_t i = 0; i < boxes.size(); ++i)
      for (std::uint32_t k = 0; k < triangles.size(); ++k)
        if (overlap(triangles[k], {boxes[i].lo, boxes[i].hi})) all[i].push_back(k);
    return all;
  }
  static void expect_equal(const Prims& found, const Prims& truth) {
    ASSERT_EQ(found.size(), truth.size());
    for (std::size_t i = 0; i < truth.size(); ++i) ASSERT_EQ(found[i], truth[i]) << "box " << i;
  }
};

float next(float x, bool up) { return std::nextafter(x, up ? INFINITY : -INFINITY); }

/// Boxes about triangles: some that touch them at a corner, an edge or the inside, or pass them by a unit in the last
/// place; flat ones, points, and large ones.
std::vector<ProbeBox> boxes_by(std::span<const Triangle> triangles, std::size_t count) {
  shapes::Random random(91);
  std::vector<ProbeBox> boxes;
  const auto at_point = [&](const glm::vec3& at, float size, bool touches) {
    ProbeBox box{};
    for (int k = 0; k < 3; ++k) {
      const bool above = random.below(2);
      const float end = touches ? at[k] : next(at[k], above), other = above ? end + size : end - size;
      box.lo[k] = std::min(end, other), box.hi[k] = std::max(end, other);
    }
    boxes.push_back(box);
  };
  while (boxes.size() < count) {
    const Triangle& t = triangles[random.below(triangles.size())];
    const float size = 0.3f * (glm::length(t[1] - t[0]) + glm::length(t[2] - t[0]));
    const float sizes[] = {0, size, 0.01f * size, 100 * size};
    const float s = sizes[random.below(4)];
    at_point(t[random.below(3)], s, random.below(2));
    at_point(0.5f * (t[0] + t[1]), s, random.below(2));
    at_point(0.25f * t[0] + 0.25f * t[1] + 0.5f * t[2], s, random.below(2));
    at_point(t[1] + random.point(size), s, true);
  }
  return boxes;
}

std::size_t all_of(const Prims& lists) {
  std::size_t sum = 0;
  for (const auto& list : lists) sum += list.size();
  return sum;
}

TEST_F(Overlap, IsWhatExactArithmeticFinds) {
  const std::pair<const char*, shapes::Triangles> cases[] = {{"soup", shapes::soup(300, 0.3f)},
                                                             {"box", shapes::box({-1, -1, -1}, {1, 1, 1})},
                                                             {"grid", shapes::grid(9)},
                                                             {"slivers", shapes::slivers(60)}};
  for (const auto& [name, triangles] : cases) {
    for (const float scale : {1.f, 0x1p-20f, 0x1p30f, 0x1p-60f}) {
      SCOPED_TRACE(std::string(name) + " times " + std::to_string(scale));
      shapes::Triangles scaled = triangles;
      for (Triangle& t : scaled)
        for (std::size_t i = 0; i < 3; ++i) t[i] *= scale;
      const std::vector<ProbeBox> boxes = boxes_by(scaled, 1500);
      const Prims truth = one_by_one(scaled, boxes);
      expect_equal(lists(scaled, boxes), truth);
      EXPECT_GT(all_of(truth), 500u);
    }
  }
}

// Cells whose planes are those of the triangles: every touch counts, on both sides.
TEST_F(Overlap, TouchesCountInAGridOfCells) {
  const shapes::Triangles triangles = shapes::box({-1, -1, -1}, {1, 1, 1});
  std::vector<ProbeBox> cells;
  for (int z = -3; z < 3; ++z)
    for (int y = -3; y < 3; ++y)
      for (int x = -3; x < 3; ++x) {
        const glm::vec3 lo = 0.5f * glm::vec3(float(x), float(y), float(z));
        cells.push_back({lo, 0, lo + 0.5f, 0});
      }
  const Prims found = lists(triangles, cells);
  expect_equal(found, one_by_one(triangles, cells));
  std::size_t touched = 0;
  for (const auto& list : found) touched += !list.empty();
  EXPECT_EQ(touched, 6u * 6 * 6 - 2 * 2 * 2);  // but for the cells that touch no side from within
}

TEST_F(Overlap, IsTheSameForEveryBuilder) {
  const shapes::Triangles triangles = shapes::joined(shapes::soup(600, 0.3f), shapes::identical(100));
  const std::vector<ProbeBox> boxes = boxes_by(triangles, 600);
  const Prims truth = one_by_one(triangles, boxes);
  for (const Builder& builder : kBuilders) {
    SCOPED_TRACE(builder.name);
    const Bvh bvh = build(triangles, {}, builder);
    DeviceTree tree(*gpu_, bvh, triangles, facts_of(bvh));
    PointQueries queries(*gpu_, tree);
    expect_equal(lists(queries, boxes), truth);
  }
}

TEST_F(Overlap, AmongInstancesIsThatOfTheMovedTriangles) {
  Forest forest = make_forest(three_meshes(), twelve_instances());
  const UnsetVector<Triangle> world = moved_triangles(forest);
  const std::vector<ProbeBox> boxes = boxes_by(world, 1200);
  DeviceTree tree(*gpu_, forest);
  PointQueries queries(*gpu_, tree);
  expect_equal(lists(queries, boxes), one_by_one(world, boxes));
}

TEST_F(Overlap, FiltersLeaveTrianglesOut) {
  const shapes::Triangles triangles = shapes::soup(400, 0.4f);
  const std::vector<ProbeBox> boxes = boxes_by(triangles, 600);
  const auto t = make(*gpu_, triangles);
  PointQueries queries(*gpu_, t->tracer->tree());
  Prims truth = one_by_one(triangles, boxes);
  PointQuery query;
  query.filters.of[FILTER_EXCLUDED] = [&](std::uint64_t first, std::span<std::uint32_t> room) {
    for (std::size_t i = 0; i < room.size(); ++i)
      room[i] = truth[first + i].empty() ? NO_HIT : truth[first + i].front();
  };
  Prims kept = truth;
  for (auto& list : kept)
    if (!list.empty()) list.erase(list.begin());
  expect_equal(lists(queries, boxes, query), kept);
}

// More triangles than a list takes a place for, and than Mesa 22.3 lets a loop visit.
TEST_F(Overlap, MayHoldMany) {
  const std::uint32_t kMany = 70000;
  const shapes::Triangles triangles = shapes::identical(kMany);
  std::vector<ProbeBox> boxes(40, {{2, 2, 2}, 0, {3, 3, 3}, 0});
  boxes[7] = boxes[39] = {{-9, -9, -9}, 0, {9, 9, 9}, 0};
  const Prims found = lists(triangles, boxes, {.builder = BuilderId::Balanced});
  for (std::size_t i = 0; i < boxes.size(); ++i) ASSERT_EQ(found[i].size(), boxes[i].hi.x == 9 ? kMany : 0u);
}

TEST_F(Overlap, DeadBoxesAndEmptyScenes) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kMost = std::numeric_limits<float>::max();
  const std::vector<ProbeBox> boxes{{{-kMost, -kMost, -kMost}, 0, {kMost, kMost, kMost}, 0},
                                    {{0, 0, 0}, 0, {1, -1, 1}, 0},
                                    {{0, kNan, 0}, 0, {1, 1, 1}, 0},
                                    {{0, 0, 0}, 0, {1, 1, INFINITY}, 0}};
  expect_equal(lists({}, boxes), Prims(4));
  shapes::Triangles triangles = shapes::grid(2);
  const std::size_t sound = triangles.size();
  triangles.push_back({glm::vec3(0), glm::vec3(0), glm::vec3(1)});
  const Prims found = lists(triangles, boxes);
  EXPECT_EQ(found[0].size(), sound);
  for (const std::size_t i : {1, 2, 3}) EXPECT_TRUE(found[i].empty()) << i;
  EXPECT_TRUE(lists(triangles, {}).empty());
}

}  // namespace
}  // namespace ballot
