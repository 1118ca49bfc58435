// Queries of points among instances. By definition their answers are those for the triangles of all instances with
// their corners moved to the world, so they are compared, bit for bit, with those of a single tree over these.
#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

#include "engine/answer/query_judge.h"
#include "engine/oracle/closest.h"
#include "engine/oracle/nearest.h"
#include "engine/tree/host/moved_corners.h"
#include "tests/device/fixture.h"
#include "tests/device/forests.h"

namespace ballot {
namespace {

using namespace forests;

constexpr float kNoEnd = std::numeric_limits<float>::infinity();
const PointQuery kWays[] = {{}, {.sides = true}, {.exact = true, .sides = true}};

/// Points in and about moved triangles, on them, at their corners and edges, and some with limits.
std::vector<ProbePoint> points_by(const UnsetVector<Triangle>& triangles, std::size_t count) {
  shapes::Random random(41);
  std::vector<ProbePoint> points;
  while (points.size() < count) {
    const Triangle& t = triangles[random.below(triangles.size())];
    const glm::vec3 middle = (t[0] + t[1] + t[2]) / 3.f;
    const float size = glm::length(t[1] - t[0]) + glm::length(t[2] - t[0]);
    points.push_back({middle + random.point(5 * size), kNoEnd});
    points.push_back({t[random.below(3)], kNoEnd});
    points.push_back({0.5f * (t[0] + t[1]), kNoEnd});
    points.push_back({middle + random.point(1e-3f * size), kNoEnd});
    points.push_back({middle + random.point(size), 0.3f * size});
  }
  points[7].at.y = std::numeric_limits<float>::quiet_NaN();
  points[8].limit = -1;
  return points;
}

struct Placed {
  const char* name;
  std::vector<UnsetVector<Triangle>> meshes;
  std::vector<Placement> placements;
};

std::vector<Placed> placed_scenes() {
  const shapes::Triangles ball = shapes::sphere(3), box = shapes::box({-1, -0.5f, -2}, {1, 0.5f, 2});
  std::vector<Placement> sizes, ring, many;
  for (int i = -3; i <= 3; ++i) {
    const float s = std::pow(10.f, float(i));
    sizes.push_back({std::uint32_t(i & 1), turned(0.4f * float(i), 1, {s, s, s}, {3 * s, s, 0})});
  }
  for (int i = 0; i < 70; ++i) {
    const float a = 0.7f * float(i);
    ring.push_back({std::uint32_t(i % 2), turned(a, 2 * a, glm::vec3(0.3f + 0.2f * std::sin(a)),
                                                 glm::vec3(4 * std::cos(a), 0.2f * a, 4 * std::sin(a)))});
  }
  for (int i = 0; i < 2000; ++i)
    many.push_back(
        {0, turned(float(i), float(2 * i), glm::vec3(0.1f, 0.3f, 0.2f), glm::vec3(i % 13, i / 13 % 13, i / 169))});
  const Transform sheared = transform({1, 0.2f, 0}, {0.9f, 0.5f, 0}, {0.3f, -0.8f, 1.5f}, {0.5f, 0, 1});
  const Transform mirrored = transform({-1, 0.2f, 0}, {0.1f, 2, 0}, {0.3f, 0, 0.7f}, {-2, 0, 1});
  return {
      {"twelve", three_meshes(), twelve_instances()},
      {"sizes", {ball, box}, sizes},
      {"ring", {ball, shapes::grid(9)}, ring},
      {"sheared and mirrored", {ball, box}, {{0, sheared}, {1, sheared}, {0, mirrored}, {1, mirrored}}},
      {"one", {box}, {{0, turned(1, 1, {2, 1, 1}, {7, 8, 9})}}},
      {"meshes far from their zero",
       {shapes::moved(ball, {500, -400, 30}), box},
       {{0, moved({-500, 400, -30})}, {1, turned(0.2f, 0, {1, 1, 1}, {3, 0, 0})}}},
      {"far from zero", {shapes::moved(ball, {1000, 0, 0}), box}, {{0, moved({2000, 1, 0})}, {1, moved({3003, 0, 0})}}},
      {"many", {shapes::box({-1, -1, -1}, {1, 1, 1})}, many}};
}

class PointInstances : public DeviceTest {
 protected:
  struct Answers {
    std::vector<Nearest> nearest;
    std::vector<std::uint32_t> inside;
  };
  static Answers ask(PointQueries& queries, std::span<const ProbePoint> points, const PointQuery& query) {
    Answers a{std::vector<Nearest>(points.size(), Nearest{{}, -1, 7, 0, 0, 7}),
              std::vector<std::uint32_t>(points.size(), 7)};
    queries.nearest(points, a.nearest, query);
    queries.inside(points, a.inside, query);
    return a;
  }
  static Answers ask(Forest& forest, std::span<const ProbePoint> points, const PointQuery& query) {
    DeviceTree tree(*gpu_, forest);
    PointQueries queries(*gpu_, tree);
    return ask(queries, points, query);
  }

  static std::size_t different(const std::vector<Nearest>& a, const std::vector<Nearest>& b) {
    std::size_t n = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      if (std::memcmp(&a[i], &b[i], sizeof(Nearest)) == 0) continue;
      if (n++ == 0)
        ADD_FAILURE() << fmt::format("point {}: triangle {} at {}, behind {}; and triangle {} at {}, behind {}", i,
                                     a[i].prim, a[i].distance, a[i].behind, b[i].prim, b[i].distance, b[i].behind);
    }
    return n;
  }
};

TEST_F(PointInstances, FindWhatOneTreeOverTheMovedTrianglesFinds) {
  for (Placed& scene : placed_scenes()) {
    SCOPED_TRACE(scene.name);
    Forest forest = make_forest(std::move(scene.meshes), scene.placements);
    const UnsetVector<Triangle> world = moved_triangles(forest);
    const std::vector<ProbePoint> points = points_by(world, 2000);
    const auto flat = make(*gpu_, world);
    PointQueries one(*gpu_, flat->tracer->tree());
    DeviceTree tree(*gpu_, forest);
    PointQueries many(*gpu_, tree);
    for (const PointQuery& query : kWays) {
      const Answers found = ask(many, points, query), truth = ask(one, points, query);
      EXPECT_EQ(different(found.nearest, truth.nearest), 0u) << "exact " << query.exact << " sides " << query.sides;
      EXPECT_GT(std::ranges::count_if(found.nearest, [](const Nearest& n) { return n.prim != NO_HIT; }), 1500);
    }
  }
}

// Instances with the identity, each of a part of a mesh, are the mesh: to the last bit, points that are far but for
// which of the equally near they name.
TEST_F(PointInstances, WithTheIdentityAreTheMesh) {
  const shapes::Triangles box = shapes::box({-2, -1, -1}, {-1.5f, 1, 1.5f});
  const std::pair<const char*, std::vector<shapes::Triangles>> cases[] = {
      {"closed", {shapes::sphere(3), box, shapes::scaled(box, 2)}},
      {"soups", {shapes::soup(300, 0.3f), shapes::soup(200, 0.5f, 9)}},
      {"slivers", {shapes::slivers(100), {}, shapes::coplanar(100)}},
      {"huge and tiny", {shapes::huge_and_tiny(150)}},
  };
  for (const auto& [name, meshes] : cases) {
    SCOPED_TRACE(name);
    shapes::Triangles all;
    std::vector<Placement> placements;
    for (const shapes::Triangles& mesh : meshes) {
      placements.push_back({std::uint32_t(placements.size()), {}});
      all = shapes::joined(std::move(all), mesh);
    }
    Forest forest = make_forest(meshes, placements);
    const std::vector<ProbePoint> points = points_by(all, 1500);
    const auto flat = make(*gpu_, all);
    PointQueries one(*gpu_, flat->tracer->tree());
    for (const PointQuery& query : kWays) {
      const Answers found = ask(forest, points, query), truth = ask(one, points, query);
      EXPECT_EQ(different(found.nearest, truth.nearest), 0u);
      if (std::string(name) == "closed") {
        EXPECT_EQ(found.inside, truth.inside);
      }
    }
  }
}

/// Returns how far a point may be from a moved mesh whose inside test is wrong by its bound, for any of the instances.
double inside_bound(const Forest& forest, const glm::vec3& p) {
  double most = 0;
  for (const Instance& i : forest.instances()) {
    const Transform& t = forest.transforms()[std::size_t(&i - forest.instances().data())];
    const Bounds& b = forest.meshes()[i.mesh].bvh->bounds;
    double e = 0, stretch = 0;
    for (int k = 0; k < 3; ++k)
      for (int j = 0; j < 3; ++j) {
        stretch += double(t.m[k][j]) * t.m[k][j];
        for (int c = 0; c < 3; ++c)
          e += 5.1 * std::abs(double(t.m[k][c]) * i.map.row[c][j]) * std::abs(double(p[j]) - t.m[j][3]);
      }
    most = std::max(most, 0x1p-24 * (e + 16 * std::sqrt(stretch) * glm::length(glm::dvec3(b.hi) - glm::dvec3(b.lo))));
  }
  return most;
}

TEST_F(PointInstances, InsideIsThatOfAnOddNumberOfMeshes) {
  const std::vector<UnsetVector<Triangle>> meshes{shapes::sphere(3), shapes::box({-1, -0.5f, -2}, {1, 0.5f, 2}), {}};
  std::vector<Placement> placements;
  for (const Placed& scene : placed_scenes())
    for (const Placement& p : scene.placements)
      if (placements.size() < 60) placements.push_back({p.mesh % 3, p.transform});
  Forest forest = make_forest(meshes, placements);
  const UnsetVector<Triangle> world = moved_triangles(forest);
  const std::vector<ProbePoint> points = points_by(world, 1500);
  const ExactClosestPoints distances{OracleScene(forest)};
  const Answers near = ask(forest, points, {}), exact = ask(forest, points, {.exact = true});
  std::size_t judged = 0, inner = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const glm::vec3& p = points[i].at;
    bool defined = false;
    for (const Instance& instance : forest.instances()) {
      const MeshTree& mesh = forest.meshes()[instance.mesh];
      const glm::vec3 at = object_ray({p, 0, {1, 0, 0}, 1}, instance.map).origin;
      if (glm::clamp(at, mesh.bvh->bounds.lo, mesh.bvh->bounds.hi) != at) continue;
      defined = defined != exact_inside(at, mesh.triangles);
    }
    EXPECT_EQ(exact.inside[i], std::uint32_t(defined)) << i;
    if (!(distances.nearest(p, kNoEnd).distance > inside_bound(forest, p))) continue;
    const bool truth = exact_inside(p, world);
    EXPECT_EQ(near.inside[i], std::uint32_t(truth)) << i;
    EXPECT_EQ(exact.inside[i], std::uint32_t(truth)) << i;
    ++judged, inner += truth;
  }
  EXPECT_GT(judged, points.size() / 3);
  EXPECT_GT(inner, 100u);
}

TEST_F(PointInstances, FollowInstancesThatMove) {
  std::vector<Placement> placements = twelve_instances();
  Forest forest = make_forest(three_meshes(), placements);
  DeviceTree tree(*gpu_, forest);
  PointQueries queries(*gpu_, tree);
  for (int step = 0; step < 4; ++step) {
    const std::vector<ProbePoint> points = points_by(moved_triangles(forest), 500);
    for (const PointQuery& query : kWays) {
      Forest fresh = make_forest(three_meshes(), placements);
      const Answers found = ask(queries, points, query), truth = ask(fresh, points, query);
      EXPECT_EQ(different(found.nearest, truth.nearest), 0u) << step;
      EXPECT_EQ(found.inside, truth.inside) << step;
    }
    std::vector<Transform> transforms;
    for (Placement& p : placements) {
      p.transform.m[0][3] += 0.5f * float(p.mesh) - 1;
      std::swap(p.transform.m[1][0], p.transform.m[2][1]);
      transforms.push_back(p.transform);
    }
    tree.set_moves_on_device(step > 0);
    tree.move_instances(transforms);
  }
}

TEST_F(PointInstances, OfArraysOnTheDeviceAreThoseOfTheHost) {
  Forest forest = make_forest({shapes::sphere(2), shapes::box({-1, -1, -1}, {1, 1, 1})},
                              std::vector<Placement>{{0, moved({1, 0, 0})}, {1, turned(1, 1, {1, 2, -1}, {-2, 0, 0})}});
  DeviceTree tree(*gpu_, forest);
  PointQueries queries(*gpu_, tree);
  const std::vector<ProbePoint> points = points_by(moved_triangles(forest), 3000);
  const std::size_t n = points.size();
  Buffer<ProbePoint> there(*gpu_, n, Access::Storage, "points");
  Buffer<Nearest> nearest(*gpu_, n, Access::Storage, "nearest");
  Buffer<std::uint32_t> inside(*gpu_, n, Access::Storage, "inside");
  there.upload(points);
  for (const PointQuery& query : kWays) {
    const Answers host = ask(queries, points, query);
    std::vector<Nearest> found(n);
    std::vector<std::uint32_t> flags(n);
    queries.nearest({there, n}, nearest, query);
    queries.inside({there, n}, inside, query);
    nearest.download(found), inside.download(flags);
    EXPECT_EQ(different(found, host.nearest), 0u);
    EXPECT_EQ(flags, host.inside);
  }
}

TEST_F(PointInstances, AnswerHardPoints) {
  Forest forest =
      make_forest({shapes::box({0, 0, 0}, {2, 2, 2}), {}, shapes::sphere(1)},
                  std::vector<Placement>{{0, {}}, {1, {}}, {2, moved({1e6f, 0, 0})}, {2, moved({9, 9, 9})}});
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<ProbePoint> points;
  for (const glm::vec3& p : {glm::vec3(nan, 0, 0), {0, kNoEnd, 0}, {1e30f, 0, 0}, {1, 1, -3e38f}, {1, 1, 1}, {2, 2, 2}})
    points.push_back({p, kNoEnd});
  points.push_back({{1, 1, 1}, 0.999f});
  points.push_back({{1e6f + 4, 0, 0}, kNoEnd});
  for (const bool exact : {false, true}) {
    const Answers found = ask(forest, points, {.exact = exact, .sides = true});
    const std::vector<Nearest>& near = found.nearest;
    for (const std::size_t i : {0u, 1u, 6u}) EXPECT_TRUE(near[i].prim == NO_HIT && near[i].distance == kNoEnd) << i;
    EXPECT_FLOAT_EQ(near[2].distance, 1e30f);
    EXPECT_FLOAT_EQ(near[3].distance, 3e38f);
    EXPECT_TRUE(near[4].distance == 1 && near[4].prim == 0 && near[4].behind == 1);
    EXPECT_TRUE(near[5].distance == 0 && near[5].prim == 2);
    EXPECT_EQ(near[7].distance, 3);
    EXPECT_EQ(found.inside, (std::vector<std::uint32_t>{0, 0, 0, 0, 1, 0, 1, 0}));
  }
  Forest empty = make_forest({{}}, std::vector<Placement>{{0, {}}}), none = make_forest({}, {});
  for (Forest* nothing : {&empty, &none}) {
    const Answers found = ask(*nothing, points, {.sides = true});
    EXPECT_TRUE(std::ranges::all_of(found.nearest, [](const Nearest& n) { return n.prim == NO_HIT; }));
    EXPECT_EQ(found.inside, std::vector<std::uint32_t>(points.size(), 0));
  }
}

// Corners that rounding moves far, onto each other: there the triangles of a tree over them lose their area.
TEST_F(PointInstances, HoldTheirBoundsWhereCornersCollapse) {
  const Transform far = turned(1, 2, {1, 1, 1}, {1e7f, -3e6f, 1e7f}), flat = turned(1, 2, {1, 1, 1e-6f}, {3, 4, 5});
  Forest forest = make_forest({shapes::sphere(3), shapes::moved(shapes::sphere(2), {1e5f, 0, 0})},
                              std::vector<Placement>{{0, far}, {0, flat}, {1, far}, {1, moved({-1e5f, 4, 4})}});
  DeviceTree tree(*gpu_, forest);
  PointQueries queries(*gpu_, tree);
  const QueryJudge judge(tree);
  const std::vector<ProbePoint> points = points_by(moved_triangles(forest), 2000);
  for (const bool exact : {false, true}) {
    const Answers found = ask(queries, points, {.exact = exact, .sides = true});
    const QueryErrors near = judge.nearest(points, found.nearest), sides = judge.sides(points, found.nearest),
                      inside = judge.inside(points, found.inside);
    EXPECT_EQ(near.beyond + sides.beyond + inside.beyond, 0u);
    EXPECT_TRUE(!exact || near.wrong + sides.wrong + inside.wrong == 0)
        << near.wrong << " " << sides.wrong << " " << inside.wrong;
  }
}

// The walk of such a point takes more steps than Mesa 22.3 lets a loop take.
TEST_F(PointInstances, WalksThatTheDriverCutsShort) {
  Forest forest =
      make_forest({shapes::identical(100000), shapes::sphere(1)},
                  std::vector<Placement>{{0, moved({0, 0, 1})}, {0, moved({0, 0, 4})}, {1, moved({9, 0, 0})}});
  std::vector<ProbePoint> points;
  for (const glm::vec3& p : {glm::vec3(0.25f, 0.25f, 3), {-1, 0, 4}, {9, 0, 0}, {-1, 0.25f, 1}})
    points.push_back({p, kNoEnd});
  const Answers found = ask(forest, points, {});
  EXPECT_TRUE(found.nearest[0].prim == 100000 && found.nearest[0].distance == 1);
  EXPECT_TRUE(found.nearest[1].prim == 100000 && found.nearest[1].distance == 1);
  EXPECT_TRUE(found.nearest[3].prim == 0 && found.nearest[3].distance == 1);
  EXPECT_EQ(found.inside, (std::vector<std::uint32_t>{0, 0, 1, 0}));
}

}  // namespace
}  // namespace ballot
