// The smallest distance of two scenes: that of all pairs of triangles.
#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/answer/clearance.h"
#include "engine/tree/host/moved_corners.h"
#include "tests/device/builders.h"
#include "tests/device/forests.h"

namespace ballot {
namespace {

using namespace forests;

constexpr double kNoEnd = std::numeric_limits<double>::infinity();

PoseInDouble random_pose(shapes::Random& random, float far) {
  const glm::vec3 axis = glm::normalize(random.point(1) + glm::vec3(0.01f)), by = random.point(far);
  const double angle = double(random.point(3).x), c = std::cos(angle), s = std::sin(angle);
  PoseInDouble pose{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto k = glm::length_t(i);
    for (std::size_t j = 0; j < 3; ++j)
      pose[i][j] = (i == j ? c : 0) + (1 - c) * double(axis[k]) * double(axis[glm::length_t(j)]);
    pose[i][(i + 1) % 3] -= s * double(axis[(k + 2) % 3]);
    pose[i][(i + 2) % 3] += s * double(axis[(k + 1) % 3]);
    pose[i][3] = double(by[k]);
  }
  return pose;
}

TriangleInDouble corners_at(const Triangle& t, const PoseInDouble& p) {
  TriangleInDouble to;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      to[i][glm::length_t(k)] =
          p[k][0] * double(t[i].x) + p[k][1] * double(t[i].y) + p[k][2] * double(t[i].z) + p[k][3];
  return to;
}

constexpr PoseInDouble kStays{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

Clearance of_all(std::span<const Triangle> scene, std::span<const Triangle> other, const PoseInDouble& pose) {
  Clearance best{kNoEnd, NO_HIT, NO_HIT, {}, {}};
  for (std::uint32_t k = 0; k < other.size(); ++k) {
    const TriangleInDouble there = corners_at(other[k], pose);
    for (std::uint32_t i = 0; i < scene.size(); ++i) {
      const TriangleGap gap = triangle_distance(corners_at(scene[i], kStays), there);
      const bool first = std::pair(i, k) < std::pair(best.prim, best.other_prim);
      if (gap.distance < best.distance || (gap.distance == best.distance && first))
        best = {gap.distance, i, k, gap.a, gap.b};
    }
  }
  return best;
}

/// Compares a walk with all pairs, at poses that leave a gap, touch, or pass through. Returns how many are at 0.
std::size_t expect_all(const ClearanceWalk& walk, std::span<const Triangle> scene, std::span<const Triangle> other) {
  shapes::Random random(17);
  std::size_t met = 0;
  for (int i = 0; i < 60; ++i) {
    const PoseInDouble pose = i == 0 ? kStays : random_pose(random, i % 2 ? 9.f : 2.f);
    const Clearance truth = of_all(scene, other, pose);
    const auto found = walk.find(pose, kNoEnd);
    EXPECT_TRUE(found);
    if (!found) return 0;
    EXPECT_EQ(found->distance, truth.distance) << i;
    met += truth.distance == 0;
    if (truth.distance == 0) continue;
    EXPECT_EQ(found->prim, truth.prim) << i;
    EXPECT_EQ(found->other_prim, truth.other_prim) << i;
    EXPECT_NEAR(glm::length(found->at - found->other_at), truth.distance, 1e-12) << i;
    EXPECT_FALSE(walk.find(pose, truth.distance * 0.999)) << i;
    const auto within = walk.find(pose, truth.distance);
    EXPECT_TRUE(within && within->prim == truth.prim) << i;
  }
  return met;
}

class ClearanceOfScenes : public Builders {};

TEST_F(ClearanceOfScenes, IsThatOfAllPairsForEveryBuilder) {
  const shapes::Triangles soup = shapes::soup(150, 0.4f), box = shapes::box({-1, -0.5f, -2}, {1, 0.25f, 1});
  for (const Builder& builder : kBuilders) {
    SCOPED_TRACE(builder.name);
    const Bvh a = build(soup, {}, builder), b = build(box, {}, builder);
    DeviceTree scene(*gpu_, a, soup, facts_of(a)), other(*gpu_, b, box, facts_of(b));
    const std::size_t met = expect_all(ClearanceWalk(scene.oracle_scene(), other.oracle_scene()), soup, box);
    EXPECT_GT(met, 5u);
    EXPECT_LT(met, 55u);
    expect_all(ClearanceWalk(other.oracle_scene(), scene.oracle_scene()), box, soup);
  }
}

TEST_F(ClearanceOfScenes, AmongInstances) {
  Forest forest = make_forest(three_meshes(), twelve_instances());
  const UnsetVector<Triangle> world = moved_triangles(forest);
  const shapes::Triangles box = shapes::box({-0.1f, -0.1f, -0.1f}, {0.1f, 0.1f, 0.1f});
  const Bvh bvh = build_bvh(box);
  DeviceTree scene(*gpu_, forest), other(*gpu_, bvh, box, facts_of(bvh));
  expect_all(ClearanceWalk(scene.oracle_scene(), other.oracle_scene()), world, box);
  expect_all(ClearanceWalk(other.oracle_scene(), scene.oracle_scene()), box, world);
}

TEST_F(ClearanceOfScenes, WithoutTrianglesIsNone) {
  const shapes::Triangles none, box = shapes::box({-1, -1, -1}, {1, 1, 1});
  const Bvh a = build_bvh(none), b = build_bvh(box);
  DeviceTree scene(*gpu_, a, none, facts_of(a)), other(*gpu_, b, box, facts_of(b));
  EXPECT_FALSE(ClearanceWalk(scene.oracle_scene(), other.oracle_scene()).find(kStays, kNoEnd));
  EXPECT_FALSE(ClearanceWalk(other.oracle_scene(), scene.oracle_scene()).find(kStays, kNoEnd));
  EXPECT_FALSE(ClearanceWalk(other.oracle_scene(), other.oracle_scene()).find(kStays, -1));
  EXPECT_EQ(ClearanceWalk(other.oracle_scene(), other.oracle_scene()).find(kStays, 0)->distance, 0);
}

}  // namespace
}  // namespace ballot
