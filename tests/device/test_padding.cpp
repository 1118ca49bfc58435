// Compares boxes that are padded in the tree (shaders/lib/numeric/box_widened.glsl) with boxes that are padded by each
// ray. The hits must be equal bit for bit, wherever a ray starts.
#include <algorithm>
#include <cmath>

#include "tests/cpu/shapes.h"
#include "tests/device/fixture.h"

namespace ballot {
namespace {

using namespace harness;

class PaddingTest : public DeviceTest {
 protected:
  static std::vector<Hit> trace(Traced& t, std::span<const Ray> rays, const char* method, const char* padding) {
    std::vector<Hit> hits(rays.size());
    t.tracer->trace(rays, hits, {Want::Nearest, method, "watertight", {{"padding", padding}}});
    return hits;
  }

  /// Expects equal hits with either padding, and at least `hits_at_least` of them.
  void expect_alike(const shapes::Triangles& triangles, std::span<const Ray> rays, std::size_t hits_at_least) {
    const auto t = make(*gpu_, triangles);
    const auto by_ray = trace(*t, rays, "while-while", "ray");
    const auto met = std::ranges::count_if(by_ray, [](const Hit& h) { return h.prim != NO_HIT; });
    EXPECT_GE(std::size_t(met), hits_at_least);
    for (const char* method : {"while-while", "packet", "frontier", "bvh8"})
      EXPECT_EQ(count_different(by_ray, trace(*t, rays, method, "tree")), 0u) << method;
  }
};

glm::vec3 middle_of(const Triangle& t) { return (t[0] + t[1] + t[2]) / 3.f; }

// A ray from farther away than 2^21 sides of the scene meets every box.
TEST_F(PaddingTest, RaysFromFarAway) {
  const shapes::Triangles triangles = shapes::soup(300, 0.3f);
  std::vector<Ray> rays;
  for (int exponent = 0; exponent < 100; exponent += 3)
    for (int axis = 0; axis < 3; ++axis)
      for (std::size_t i = 0; i < triangles.size(); i += 7) {
        Ray r{middle_of(triangles[i]), 0, glm::vec3(0), 3e38f};
        r.dir[axis] = i % 2 ? 1.f : -1.f;
        r.origin[axis] = std::ldexp(-r.dir[axis], exponent);
        rays.push_back(r);
      }
  expect_alike(triangles, rays, rays.size() / 2);
}

// From 7.6 * 10^5 away boxes are padded by more than the scene. A ray through the scene meets every box. One that
// passes beside it, but within the padding, meets few: the boxes on its side.
TEST_F(PaddingTest, RaysBesideTheSceneCostLittle) {
  const auto t = make(*gpu_, shapes::soup(2000, 0.01f));
  constexpr std::size_t kRays = 64;
  const auto tested_by_ray = [&](const std::string& method, float x) {
    const bool chooses = method != "packet-wide" && method != "bvh4";  // what a device prefers may be `tree`
    const Knobs knobs = chooses ? Knobs{{"padding", "ray"}} : Knobs{};
    Buffer<Ray> rays(*gpu_, kRays, Access::Storage, "rays");
    Buffer<Hit> hits(*gpu_, kRays, Access::Storage, "hits");
    Buffer<RayStats> stats(*gpu_, kRays, Access::Storage, "stats");
    rays.upload(std::vector<Ray>(kRays, Ray{{x, x, -7.6e5f}, 0, {0, 0, 1}, 1e30f}));
    t->tracer->trace_counted(rays, hits, kRays, {Want::Nearest, method, "watertight", knobs}, stats);
    std::vector<RayStats> all(kRays);
    stats.download(all);
    double tested = 0;
    for (const RayStats& one : all) tested += one.triangles_tested;
    return tested / kRays;
  };
  for (const char* method : {"while-while", "packet", "packet-wide", "bvh4", "bvh8"}) {
    EXPECT_GE(tested_by_ray(method, 0), 2000) << method;
    EXPECT_LT(tested_by_ray(method, -3.1f), 1000) << method;
  }
}

// For a ray that starts on a triangle, the padding of a box decides whether its first leaf is visited.
TEST_F(PaddingTest, RaysThatBeginOnTriangles) {
  const shapes::Triangles triangles = shapes::grid(24);
  std::vector<Ray> rays = shapes::random_rays(6000, 3, 1);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Triangle& t = triangles[i % triangles.size()];
    rays[i].origin = i % 3 ? middle_of(t) : t[i % 9 / 3];
    rays[i].origin.y += std::ldexp(float(i % 5) - 2, -20);
    rays[i].t_min = i % 2 ? 0.f : -1.f;
  }
  expect_alike(triangles, rays, rays.size() / 4);
}

/// Scenes at coordinates where floats are up to half a unit apart. Boxes are stored relative to the middle of the
/// scene.
class FarFromZero : public PaddingTest {
 protected:
  static constexpr float kSize = 1024;
  static constexpr glm::vec3 kAt{448000, 0, 5411000};

  static shapes::Triangles far(const shapes::Triangles& near) {
    return shapes::moved(shapes::scaled(near, kSize), kAt);
  }

  /// Also expects equal hits with packet-wide, bvh4 and leaf boxes, for which boxes cannot be padded in the tree.
  void expect_all_alike(const shapes::Triangles& triangles, std::span<const Ray> rays, std::size_t hits_at_least) {
    expect_alike(triangles, rays, hits_at_least);
    const auto t = make(*gpu_, triangles);
    const auto by_ray = trace(*t, rays, "while-while", "ray");
    for (const Query& query :
         {Query{Want::Nearest, "packet-wide", "watertight", {}}, Query{Want::Nearest, "bvh4", "watertight", {}},
          Query{Want::Nearest, "while-while", "watertight", {{"leaf_box", "1"}}}}) {
      std::vector<Hit> hits(rays.size());
      t->tracer->trace(rays, hits, query);
      EXPECT_EQ(count_different(by_ray, hits), 0u) << query.method;
    }
  }
};

TEST_F(FarFromZero, RaysFromNearby) {
  const shapes::Triangles triangles = far(shapes::soup(400, 0.3f));
  std::vector<Ray> rays = shapes::edge_rays(triangles, 3000, kAt + glm::vec3(2000, 3000, -500));
  for (Ray r : shapes::random_rays(3000)) {
    r.origin = kAt + kSize * r.origin;
    rays.push_back(r);
  }
  expect_all_alike(triangles, rays, rays.size() / 4);
}

// The distance of these origins from the middle of the scene is rounded.
TEST_F(FarFromZero, RaysFromElsewhere) {
  const shapes::Triangles triangles = far(shapes::soup(400, 0.3f));
  std::vector<Ray> rays;
  for (const glm::vec3& from : {glm::vec3(0.1f, 3000.7f, 0.3f), glm::vec3(-1.0000001e7f, 12345.678f, 3.3333333e6f),
                                glm::vec3(448000.03f, 7.7e6f, 0.7f)})
    for (const Ray& r : shapes::edge_rays(triangles, 2000, from)) rays.push_back(r);
  expect_all_alike(triangles, rays, rays.size() / 4);
}

// With short rays, method frontier tests the boxes of its frontier against one box about the segments of all rays of a
// subgroup.
TEST_F(FarFromZero, ShortRays) {
  const shapes::Triangles triangles = far(shapes::soup(400, 0.3f));
  std::vector<Ray> rays = shapes::edge_rays(triangles, 6000, kAt + glm::vec3(300, 400, -500));
  for (std::size_t i = 0; i < rays.size(); ++i) {
    rays[i].t_max = i % 2 ? 1.001f : 1e-3f * kSize;
    rays[i].t_min = i / 64 % 2 ? 0.f : -0.5f;
  }
  expect_all_alike(triangles, rays, rays.size() / 8);
}

TEST_F(FarFromZero, ATreeOfOneLeaf) {
  const shapes::Triangles triangles = far(shapes::soup(1, 0.5f));
  expect_all_alike(triangles, shapes::edge_rays(triangles, 1000, kAt + glm::vec3(3000, 2000, 1000)), 250);
}

TEST_F(PaddingTest, ASceneTooSmallIsRefused) {
  shapes::Triangles triangles = shapes::soup(50, 0.3f);
  for (Triangle& t : triangles)
    for (glm::vec3& v : t) v *= 1e-25f;
  const auto t = make(*gpu_, triangles);
  const std::vector<Ray> rays = shapes::random_rays(10);
  EXPECT_THROW(trace(*t, rays, "while-while", "tree"), Error);
  EXPECT_NO_THROW(trace(*t, rays, "while-while", "ray"));
}

}  // namespace
}  // namespace ballot
