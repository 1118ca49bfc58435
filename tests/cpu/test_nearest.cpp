// Tests of the exact answers of point queries, and of the topology of meshes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/oracle/nearest.h"
#include "engine/oracle/self_crossings.h"
#include "engine/tree/host/topology.h"
#include "tests/cpu/shapes.h"

namespace ballot {
namespace {

const Triangle kRight{{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}}};

TEST(ExactNearest, RegionsOfATriangle) {
  const auto distance = [](float x, float y, float z) { return exact_distance({x, y, z}, kRight).distance(); };
  EXPECT_EQ(distance(0.5f, 0.5f, 3), 3);
  EXPECT_EQ(distance(0.5f, 0.5f, 0), 0);
  EXPECT_EQ(distance(1, -4, 0), 4);  // edge 0 1
  EXPECT_EQ(distance(1, -4, 3), 5);
  EXPECT_EQ(distance(2, 2, 0), std::sqrt(2.0));  // edge 1 2
  EXPECT_EQ(distance(-3, 1, 4), 5);              // edge 2 0
  EXPECT_EQ(distance(5, -4, 0), 5);              // corner 1
  EXPECT_EQ(distance(-3, -4, 0), 5);             // corner 0
  EXPECT_EQ(distance(-3, 6, 12), 13);            // corner 2
  EXPECT_EQ(exact_distance({1, 3, 4}, Triangle{glm::vec3(0), glm::vec3(1, 0, 0), glm::vec3(2, 0, 0)}).distance(),
            5);  // no area
}

TEST(ExactNearest, EqualDistancesAreEqual) {
  const auto [a, b, c] = kRight;
  const glm::vec3 point(1.7f, 1.3f, 0.1f);
  EXPECT_EQ(exact_distance(point, Triangle{a, b, c}), exact_distance(point, Triangle{c, b, glm::vec3(0, 0, -3)}));
  EXPECT_LT(exact_distance({0.1f, 0, 0}, kRight), exact_distance({0.1f, 0, 0x1p-40f}, kRight));
}

TEST(ExactInside, PointsOfALattice) {
  const shapes::Triangles cube = shapes::box({0, 0, 0}, {2, 2, 2});
  for (int x = -1; x <= 3; ++x)
    for (int y = -1; y <= 3; ++y)
      for (int z = -1; z <= 3; ++z) {
        // A point on the surface counts as the one beside it, towards larger x, then y, then z.
        const auto within = [](int i) { return i >= 0 && i < 2; };
        EXPECT_EQ(exact_inside(glm::vec3(x, y, z), cube), within(x) && within(y) && within(z))
            << x << " " << y << " " << z;
      }
}

TEST(Topology, ClosedMeshes) {
  for (const shapes::Triangles& mesh : {shapes::sphere(2), shapes::box({0, 0, 0}, {1, 2, 3})}) {
    const Topology t = topology_of(mesh);
    EXPECT_EQ(t.triangles, mesh.size());
    EXPECT_EQ(t.edges, mesh.size() * 3 / 2);
    EXPECT_TRUE(t.closed() && t.manifold() && t.consistently_wound());
  }
  const Topology none = topology_of({});
  EXPECT_TRUE(none.closed() && none.manifold() && none.consistently_wound());
}

TEST(Topology, FaultsAreNamed) {
  shapes::Triangles mesh = shapes::sphere(2);
  const Triangle gone = mesh[5];
  mesh.erase(mesh.begin() + 5);
  Topology t = topology_of(mesh);
  EXPECT_EQ(t.open, 3u);
  EXPECT_EQ(t.boundary, 3u);
  ASSERT_EQ(t.first_boundary.size(), 3u);
  EXPECT_TRUE(std::ranges::count(gone, t.first_boundary[0].from) && std::ranges::count(gone, t.first_boundary[0].to));
  EXPECT_TRUE(t.manifold() && t.consistently_wound());

  mesh = shapes::sphere(2);
  std::swap(mesh[7][0], mesh[7][1]);
  t = topology_of(mesh);
  EXPECT_TRUE(t.closed() && t.manifold());
  EXPECT_EQ(t.flipped, 3u);
  EXPECT_EQ(t.first_flipped.front().triangles, 2u);

  mesh = shapes::sphere(2);
  mesh.push_back(Triangle{mesh[0][0], mesh[0][1], glm::vec3(9)});  // a fin
  t = topology_of(mesh);
  EXPECT_EQ(t.nonmanifold, 1u);
  EXPECT_EQ(t.first_nonmanifold.front().triangles, 3u);
  EXPECT_EQ(t.open, 3u);
  EXPECT_EQ(t.boundary, 2u);
}

TEST(Topology, TrianglesWithoutArea) {
  shapes::Triangles mesh = shapes::sphere(1);
  const auto [a, b, c] = mesh[0];
  mesh.push_back(Triangle{a, a, b});
  mesh.push_back(Triangle{c, glm::vec3(0), glm::vec3(-0.f)});
  EXPECT_TRUE(topology_of(mesh).closed());
  mesh = shapes::grid(1, 0);  // a T-junction that a flat triangle closes stays open: no query finds that triangle
  mesh.push_back(Triangle{glm::vec3(-1, 0, -1), glm::vec3(0, 0, -1), glm::vec3(1, 0, -1)});
  const Topology t = topology_of(mesh);
  EXPECT_EQ(t.flat, 1u);
  EXPECT_EQ(t.boundary, 4u);
}

TEST(Topology, NoMoreThanTenAreNamed) {
  const Topology t = topology_of(shapes::soup(2000, 0.1f));
  EXPECT_EQ(t.boundary, 6000u);
  ASSERT_EQ(t.first_boundary.size(), 10u);
  EXPECT_EQ(t.first_boundary[0].prim, 0u);
  EXPECT_EQ(t.first_boundary[9].prim, 3u);
}

TEST(SelfCrossings, OfKnownMeshes) {
  const auto of = [](const shapes::Triangles& triangles) { return self_crossings(triangles); };
  EXPECT_TRUE(of(shapes::sphere(2)).prims.empty());
  EXPECT_TRUE(of({}).prims.empty());
  const shapes::Triangles cube = shapes::box({0, 0, 0}, {4, 4, 4});
  EXPECT_TRUE(of(shapes::joined(cube, shapes::box({1, 1, 1}, {3, 3, 3}))).prims.empty());
  EXPECT_TRUE(of(shapes::joined(cube, shapes::box({4, 0, 0}, {6, 4, 4}))).prims.empty());  // they touch
  const SelfCrossings through = of(shapes::joined(cube, shapes::box({1, 1, 1}, {3, 3, 9})));
  EXPECT_GE(through.prims.size(), 4u);
  ASSERT_FALSE(through.first.empty());
  for (const auto& [a, b] : through.first) EXPECT_TRUE(a < 12 && b >= 12);
}

TEST(SelfCrossings, EqualBruteForce) {
  shapes::Triangles spheres = shapes::sphere(2);
  for (const Triangle& t : shapes::moved(shapes::sphere(2), {0.5f, 0.25f, 0.125f})) spheres.push_back(t);
  for (const shapes::Triangles& triangles : {shapes::soup(150, 0.5f), spheres}) {
    std::vector<std::uint32_t> prims;
    for (std::uint32_t i = 0; i < triangles.size(); ++i)
      for (std::uint32_t k = 0; k < triangles.size(); ++k)
        if (i != k && pass_through(triangles[i], triangles[k])) {
          prims.push_back(i);
          break;
        }
    EXPECT_EQ(self_crossings(triangles).prims, prims);
    EXPECT_GT(prims.size(), 10u);
  }
}

// Work is bounded where all triangles overlap. The result says so, and does not depend on how it was found.
TEST(SelfCrossings, OfTrianglesThatAllOverlap) {
  const shapes::Triangles soup = shapes::soup(4000, 2);
  const SelfCrossings found = self_crossings(soup), again = self_crossings(soup);
  EXPECT_FALSE(found.whole);
  EXPECT_GE(found.pairs, kMostCrossingPairs);
  EXPECT_LT(found.pairs, 8 * kMostCrossingPairs);
  EXPECT_GT(found.prims.size(), 1000u);
  EXPECT_EQ(found.pairs, again.pairs);
  EXPECT_EQ(found.prims, again.prims);
  EXPECT_EQ(found.first, again.first);
  for (const auto& [a, b] : found.first) EXPECT_TRUE(pass_through(soup[a], soup[b]));
  const SelfCrossings few = self_crossings(shapes::soup(150, 0.5f));
  EXPECT_TRUE(few.whole);
  EXPECT_GT(few.pairs, few.first.size());
  EXPECT_TRUE(self_crossings(shapes::identical(3000)).prims.empty());
  EXPECT_TRUE(self_crossings(shapes::coplanar(3000)).prims.empty());
}

// What `progress` throws ends the search soon.
TEST(SelfCrossings, CanBeStopped) {
  int calls = 0;
  const auto stop = [&](double) {
    if (++calls > 3) throw Error(Failure::Work, "stopped");
  };
  EXPECT_THROW(self_crossings(shapes::soup(4000, 2), stop), Error);
  EXPECT_LT(calls, 100);
}

// The tip of one triangle ends above, in and below another one, by less than rounding of differences would tell.
TEST(SelfCrossings, AreDecidedWithoutRounding) {
  const Triangle flat{{{-1e6f, -1e6f, 1}, {1e6f, -1e6f, 1}, {0, 1e6f, 1}}};
  for (const float tip : {std::nextafter(1.f, 2.f), 1.f, std::nextafter(1.f, 0.f)})
    EXPECT_EQ(pass_through(flat, Triangle{{{0, 0, tip}, {1, 0, 1e6f}, {0, 1, 1e6f}}}), tip < 1);
}

}  // namespace
}  // namespace ballot
