// Shapes other than triangles: every method and builder finds the same hits, which hold to brute force in long double.
#include <cmath>
#include <map>

#include "engine/core/error.h"
#include "engine/scene/device_scene.h"
#include "engine/tree/host/instance.h"
#include "tests/cpu/shape_judge.h"
#include "tests/device/crossing_test.h"

namespace ballot {
namespace {

using namespace test;

constexpr ShapeKind kClosed[] = {ShapeKind::Spheres, ShapeKind::Capsules, ShapeKind::Boxes};
constexpr float kFarAway = 1e4f;

class ShapesTest : public CrossingTest {
 protected:
  static std::unique_ptr<DeviceScene> world_of(Scene scene, BuilderId builder = BuilderId::Balanced) {
    DeviceSceneOptions options;
    options.context = gpu_;
    options.build.builder = builder;
    options.use_cache = false;
    return std::make_unique<DeviceScene>(std::move(scene), options);
  }
  static std::unique_ptr<DeviceScene> world_of(ShapeKind kind, std::vector<Shape> shapes) {
    return world_of(scene_of({{kind, std::move(shapes)}}, {{0}}));
  }
};

std::vector<Ray> rays_at_shapes(std::size_t count, std::uint32_t seed) {
  shapes::Random random(seed);
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < count; ++i) {
    const glm::vec3 from = random.point(i % 4 == 0 ? 1.f : 4.f), to = random.point(1.2f);
    rays.push_back({from, 0, (to - from) * random.in(0.01f, 10), kFarAway});
    if (i % 16 == 0) rays.back().t_max = 0.7f;
  }
  return rays;
}

/// The rounding error that a hit of a shape may have, as a distance: of what lies M from a ray's origin at most.
Number room_of(const Shape& s, const Ray& ray, Number t) {
  Number most = 0;
  for (int k = 0; k < 3; ++k) {
    const Number to = std::abs(t * ray.dir[k]), own = std::abs(Number(s.a[k]) - ray.origin[k]);
    most = std::max({most, to, own, std::abs(Number(s.b[k]) - ray.origin[k]), Number(s.a.w), Number(s.b.w)});
  }
  return 24 * kUlp * most;
}

/// Expects that a hit lies on its shape, and that the ray met none before; or none at all.
void expect_nearest(ShapeKind kind, std::span<const Shape> all, const Ray& ray, const Hit& hit, std::size_t number) {
  SCOPED_TRACE(fmt::format("{}, ray {}, prim {}, t {}", info_of(kind).name, number, hit.prim, hit.t));
  const Number end = hit.prim == NO_HIT ? Number(ray.t_max) : Number(hit.t);
  const Number unit = test::length(vector(ray.dir));
  if (hit.prim != NO_HIT) {
    const Shape& s = all[hit.prim];
    const Deepest at = deepest(kind, s, ray, end, end);
    EXPECT_LE(std::abs(at.value), room_of(s, ray, end)) << "off its surface";
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (is_nothing(kind, all[i])) continue;
    const Number room = room_of(all[i], ray, std::min(end, Number(8) / unit));
    const Number begin = deepest(kind, all[i], ray, ray.t_min, ray.t_min).value;
    const Number last = deepest(kind, all[i], ray, end, end).value;
    if (begin < -room) {
      EXPECT_LE(last, room) << "left shape " << i << " before";
    } else {
      EXPECT_GE(deepest(kind, all[i], ray, ray.t_min, end - room / unit).value, -room)
          << "met shape " << i << " before";
    }
  }
}

std::vector<Hit> traced(DeviceScene& world, std::span<const Ray> rays, const Query& query) {
  std::vector<Hit> hits(rays.size());
  world.trace(rays, hits, query);
  return hits;
}

TEST_F(ShapesTest, HoldToTheOracle) {
  const std::vector<Ray> rays = rays_at_shapes(250, 3);
  for (const ShapeKind kind : kClosed) {
    const std::vector<Shape> all = random_shapes(kind, 80, 0.2f, 7);
    const auto world = world_of(kind, all);
    const std::vector<Hit> hits = traced(*world, rays, {.method = "while-while"});
    std::size_t found = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      expect_nearest(kind, all, rays[i], hits[i], i);
      found += hits[i].prim != NO_HIT;
    }
    EXPECT_GT(found, rays.size() / 4) << info_of(kind).name;
  }
}

TEST_F(ShapesTest, DiscsHoldToTheOracle) {
  const std::vector<Ray> rays = rays_at_shapes(500, 4);
  const std::vector<Shape> all = random_shapes(ShapeKind::Discs, 150, 0.2f, 8);
  const auto world = world_of(ShapeKind::Discs, all);
  const std::vector<Hit> hits = traced(*world, rays, {.method = "while-while"});
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Ray& ray = rays[i];
    const Number unit = test::length(vector(ray.dir));
    Number nearest = std::numeric_limits<Number>::infinity();
    for (std::size_t d = 0; d < all.size(); ++d) {
      const Vector n = vector(all[d].b), from = minus(vector(all[d].a), vector(ray.origin)), dir = vector(ray.dir);
      const Number t = product(from, n) / product(dir, n);
      const Vector at = minus(Vector{t * dir[0], t * dir[1], t * dir[2]}, from);
      const Number beyond = test::length(at) - all[d].a.w;
      // A point off along the ray by one unit of the last place of M is off across the disc by that over the sine.
      const Number room = room_of(all[d], ray, t) / std::max<Number>(1e-6L, std::abs(product(dir, n)) / unit);
      if (hits[i].prim == d) {
        EXPECT_LE(std::abs(t - hits[i].t) * unit, room) << i;
        EXPECT_LE(beyond, room) << i;
      }
      if (beyond < -room && t > room / unit && t < ray.t_max - room / unit)
        nearest = std::min(nearest, t + room / unit);
    }
    EXPECT_LE(hits[i].prim == NO_HIT ? Number(ray.t_max) : Number(hits[i].t), nearest) << i;
  }
}

Transform spun(float angle, float scale, glm::vec3 to, float stretch = 1) {
  const float c = std::cos(angle) * scale, s = std::sin(angle) * scale;
  return {{{c, -s * stretch, 0, to.x}, {s, c * stretch, 0, to.y}, {0, 0, scale, to.z}}};
}

/// All kinds and triangles, some placed several times.
Scene mixed() {
  std::vector<ShapeMesh> meshes;
  for (const ShapeInfo& info : kShapes)
    if (info.kind != ShapeKind::Triangles)
      meshes.push_back({info.kind, random_shapes(info.kind, 90, 0.1f, 11 + std::uint32_t(info.kind)), {}});
    else if (!info.raster)
      meshes.push_back({info.kind, {}, shapes::soup(120, 0.1f)});
  std::vector<Placement> placements;
  for (std::uint32_t m = 0; m < meshes.size(); ++m) {
    placements.push_back({m, {}});
    placements.push_back({m, spun(0.5f + float(m), 0.7f, {0.4f, -0.3f, 0.2f})});
  }
  placements.push_back({1, spun(0.3f, 0.8f, {-0.5f, 0, 0.3f}, 1.7f)});  // ellipsoids
  return scene_of(std::move(meshes), std::move(placements));
}

TEST_F(ShapesTest, AllMethodsAndBuildersAgree) {
  const std::vector<Ray> rays = rays_at_shapes(3000, 5);
  std::vector<Hit> first, any;
  for (const BuilderId builder : {BuilderId::Balanced, BuilderId::Best, BuilderId::Device}) {
    const auto world = world_of(mixed(), builder);
    for (const Method& method : kMethods) {
      if (!method.instances ||
          (builder != BuilderId::Balanced && method.name != "while-while" && method.name != "bvh8"))
        continue;
      const std::vector<Hit> hits = traced(*world, rays, {.method = std::string(method.name)});
      if (first.empty()) first = hits;
      EXPECT_EQ(std::memcmp(hits.data(), first.data(), first.size() * sizeof(Hit)), 0) << method.name;
      Query query{.method = std::string(method.name)};
      query.want = Want::Any;
      const std::vector<Hit> some = traced(*world, rays, query);
      for (std::size_t i = 0; i < rays.size(); ++i)
        EXPECT_EQ(some[i].prim == NO_HIT, first[i].prim == NO_HIT) << method.name << " ray " << i;
    }
  }
  std::map<std::uint32_t, std::size_t> kinds;
  for (const Hit& h : first)
    if (h.prim != NO_HIT) ++kinds[h.prim];
  EXPECT_GT(kinds.size(), 300u);
}

// Mode exact is the oracle's, whoever built the trees; what mode watertight answers otherwise lies within its bound.
TEST_F(ShapesTest, ExactIsTheOracles) {
  const std::vector<Ray> rays = rays_at_shapes(3000, 5);
  std::vector<Hit> first;
  for (const BuilderId builder : {BuilderId::Balanced, BuilderId::Best, BuilderId::Device}) {
    const auto world = world_of(mixed(), builder);
    for (const char* method : {"auto", "packet", "bvh8"}) {
      const std::vector<Hit> hits = traced(*world, rays, {.method = method, .numeric = "exact"});
      if (first.empty()) first = hits;
      EXPECT_EQ(std::memcmp(hits.data(), first.data(), first.size() * sizeof(Hit)), 0) << method;
    }
    Query any{.numeric = "exact"};
    any.want = Want::Any;
    const std::vector<Hit> some = traced(*world, rays, any);
    for (std::size_t i = 0; i < rays.size(); ++i) EXPECT_EQ(some[i].prim == NO_HIT, first[i].prim == NO_HIT) << i;
    const std::vector<Hit> usual = traced(*world, rays, {.method = "while-while"});
    for (std::size_t i = 0; i < rays.size(); ++i) {
      EXPECT_EQ(usual[i].prim, first[i].prim) << i;
      if (usual[i].prim == NO_HIT || usual[i].prim != first[i].prim) continue;
      const float unit = glm::length(rays[i].dir);
      EXPECT_LE(std::abs(usual[i].t - first[i].t) * unit, 1e-4f) << i;
      EXPECT_NEAR(usual[i].u, first[i].u, 1e-3f) << i;
      EXPECT_NEAR(usual[i].v, first[i].v, 1e-3f) << i;
    }
  }
}

// Crossings come in pairs, and the first one is the nearest hit.
TEST_F(ShapesTest, Crossings) {
  const auto world = world_of(mixed());
  const std::vector<Ray> rays = rays_at_shapes(700, 6);
  const std::vector<Hit> nearest = traced(*world, rays, {.method = "while-while"});
  const auto all = lists(world->rays(), source_of(rays));
  const auto counted = counts(world->rays(), rays);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    EXPECT_EQ(all[i].size(), counted[i]);
    ASSERT_EQ(all[i].empty(), nearest[i].prim == NO_HIT) << i;
    if (all[i].empty()) continue;
    EXPECT_EQ(std::memcmp(&all[i][0], &nearest[i], sizeof(Hit)), 0) << i;
    for (std::size_t k = 1; k < all[i].size(); ++k) EXPECT_LE(all[i][k - 1].t, all[i][k].t);
  }
  const auto fronts = counts(world->rays(), rays, {.cull = Cull::Back}),
             backs = counts(world->rays(), rays, {.cull = Cull::Front});
  for (std::size_t i = 0; i < rays.size(); ++i) EXPECT_EQ(fronts[i] + backs[i], counted[i]) << i;
}

TEST_F(ShapesTest, CrossingsOfClosedShapesArePairs) {
  for (const ShapeKind kind : kClosed) {
    const auto world = world_of(kind, random_shapes(kind, 200, 0.2f, 9));
    std::vector<Ray> rays = rays_at_shapes(500, 10);
    for (Ray& r : rays) r.t_min = -kFarAway, r.t_max = kFarAway;
    for (const std::uint32_t n : counts(world->rays(), rays)) EXPECT_EQ(n % 2, 0u) << info_of(kind).name;
  }
}

TEST_F(ShapesTest, ClosestPointsAndInside) {
  shapes::Random random(12);
  for (const ShapeKind kind : kClosed) {
    const std::vector<Shape> all = random_shapes(kind, 60, 0.15f, 13);
    const Transform move = spun(0.8f, 1.5f, {0.2f, 0.1f, -0.4f});
    const auto world = world_of(scene_of({{kind, all}}, {{0, move}}));
    std::vector<ProbePoint> points;
    for (int i = 0; i < 800; ++i) points.push_back({random.point(2), INFINITY});
    std::vector<Nearest> found(points.size());
    std::vector<std::uint32_t> inside(points.size());
    world->points().nearest(points, found);
    world->points().inside(points, inside);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const glm::vec3 from = points[i].at - glm::vec3(move.m[0][3], move.m[1][3], move.m[2][3]);
      Vector at{};
      for (int c = 0; c < 3; ++c) {
        Number sum = 0;
        for (int r = 0; r < 3; ++r) sum += Number(move.m[r][c]) * from[r];
        at[std::size_t(c)] = sum / (1.5L * 1.5L);
      }
      Number least = std::numeric_limits<Number>::infinity();
      std::size_t holds = 0;
      bool sure = true;
      for (const Shape& s : all) {
        if (is_nothing(kind, s)) continue;
        const Number d = outside(kind, s, at);
        least = std::min(least, std::abs(d));
        holds += d < 0;
        sure = sure && std::abs(d) > 1e-5L;
      }
      // Within a capsule whose ends differ, outside() is no distance from the surface.
      if (kind != ShapeKind::Capsules || holds == 0) {
        EXPECT_NEAR(double(least) * 1.5, found[i].distance, 2e-6) << info_of(kind).name << " point " << i;
      }
      EXPECT_NEAR(glm::length(found[i].at - points[i].at), found[i].distance, 2e-6);
      if (sure) {
        EXPECT_EQ(inside[i], holds % 2) << info_of(kind).name << " point " << i;
      }
    }
  }
}

// Known traps: tangents, spheres far away, origins inside and on the surface, no radius, no length, no thickness.
TEST_F(ShapesTest, HardCases) {
  const auto hit = [&](ShapeKind kind, const Shape& s, const Ray& ray) {
    const auto world = world_of(kind, std::vector<Shape>{s});
    return traced(*world, std::vector<Ray>{ray}, {.method = "while-while"})[0];
  };
  const Shape unit{{0, 0, 0, 1}, {0, 0, 0, 0}};
  EXPECT_EQ(hit(ShapeKind::Spheres, unit, {{0, 1, -4}, 0, {0, 0, 1}, kFarAway}).t, 4);    // tangent
  EXPECT_EQ(hit(ShapeKind::Spheres, unit, {{0, 0, 0}, 0, {0, 0, 2}, kFarAway}).t, 0.5f);  // from its middle
  EXPECT_EQ(hit(ShapeKind::Spheres, unit, {{0, 0, -1}, 0, {0, 0, -1}, kFarAway}).t, 0);   // on the surface, away
  EXPECT_EQ(hit(ShapeKind::Spheres, unit, {{0, 0, -1}, 1e-3f, {0, 0, 1}, kFarAway}).t, 2);
  EXPECT_EQ(hit(ShapeKind::Spheres, unit, {{0, 1.0001f, -4}, 0, {0, 0, 1}, kFarAway}).prim, NO_HIT);
  EXPECT_EQ(hit(ShapeKind::Spheres, {{1, 2, 3, 0}, {}}, {{1, 2, 0}, 0, {0, 0, 1}, kFarAway}).prim, NO_HIT);
  const Hit far = hit(ShapeKind::Spheres, {{1000, 2000, 3000, 0.01f}, {}}, {{0, 0, 0}, 0, {1, 2, 3}, kFarAway});
  EXPECT_NEAR(far.t, 1000, 0.01);
  const Shape point{{0, 0, 0, 1}, {0, 0, 0, 1}}, held{{0, 0, 0, 1}, {0.2f, 0, 0, 0.5f}},
      holds{{0, 0, 0, 0.5f}, {0.2f, 0, 0, 1}};
  EXPECT_EQ(hit(ShapeKind::Capsules, point, {{0, 0, -4}, 0, {0, 0, 1}, kFarAway}).t, 3);
  EXPECT_EQ(hit(ShapeKind::Capsules, held, {{0, 0, -4}, 0, {0, 0, 1}, kFarAway}).t, 3);
  EXPECT_EQ(hit(ShapeKind::Capsules, holds, {{0.2f, 0, -4}, 0, {0, 0, 1}, kFarAway}).t, 3);
  const Shape rod{{0, 0, 0, 0.5f}, {0, 0, 8, 0.5f}};
  EXPECT_EQ(hit(ShapeKind::Capsules, rod, {{0.25f, 0, 4}, 0, {1, 0, 0}, kFarAway}).t, 0.25f);      // from inside
  EXPECT_EQ(hit(ShapeKind::Capsules, rod, {{0, 0, -4}, 0, {0, 0, 1}, kFarAway}).t, 3.5f);          // along its axis
  EXPECT_NEAR(hit(ShapeKind::Capsules, rod, {{0.5f, 0, -4}, 0, {0, 0, 1}, kFarAway}).t, 4, 1e-6);  // along its side
  const Shape cone{{0, 0, 0, 1}, {0, 0, 4, 0}};
  EXPECT_NEAR(hit(ShapeKind::Capsules, cone, {{0, 0, 9}, 0, {0, 0, -1}, kFarAway}).t, 5, 2e-6);  // onto its tip
  const Shape sheet{{-1, -1, 2, 0}, {1, 1, 2, 0}}, line{{-1, 0, 2, 0}, {1, 0, 2, 0}};
  EXPECT_EQ(hit(ShapeKind::Boxes, sheet, {{0.5f, 0.5f, 0}, 0, {0, 0, 1}, kFarAway}).t, 2);
  EXPECT_EQ(hit(ShapeKind::Boxes, sheet, {{-3, 0, 2}, 0, {1, 0, 0}, kFarAway}).t, 2);  // in its plane
  EXPECT_EQ(hit(ShapeKind::Boxes, line, {{0, 0, 0}, 0, {0, 0, 1}, kFarAway}).prim, NO_HIT);
  const Shape disc{{0, 0, 2, 1}, {0, 0, 1, 0}};
  EXPECT_EQ(hit(ShapeKind::Discs, disc, {{0.5f, 0.5f, 0}, 0, {0, 0, 1}, kFarAway}).t, 2);
  EXPECT_EQ(hit(ShapeKind::Discs, disc, {{-3, 0, 2}, 0, {1, 0, 0}, kFarAway}).prim, NO_HIT);  // in its plane
}

TEST_F(ShapesTest, Refusals) {
  const auto world = world_of(ShapeKind::Spheres, random_shapes(ShapeKind::Spheres, 10, 0.1f, 1));
  const std::vector<Ray> rays = rays_at_shapes(64, 1);
  EXPECT_THROW(traced(*world, rays, {.method = "while-while", .numeric = "double"}), Error);
  EXPECT_THROW(traced(*world, rays, {.method = "while-while", .numeric = "fast"}), Error);
  EXPECT_NO_THROW(traced(*world, rays, {.method = "while-while", .numeric = "plain"}));
  EXPECT_THROW(counts(world->rays(), rays, {.exact = true}), Error);
  const auto stretched = world_of(
      scene_of({{ShapeKind::Spheres, random_shapes(ShapeKind::Spheres, 10, 0.1f, 1)}}, {{0, spun(0, 1, {}, 2)}}));
  std::vector<ProbePoint> points(10, {{0, 0, 0}, INFINITY});
  std::vector<Nearest> found(points.size());
  EXPECT_THROW(stretched->points().nearest(points, found), Error);
  const std::vector<glm::vec3> one{{0, 0, 0}};
  const std::vector<float> bad{-1}, nan{NAN}, good{1};
  EXPECT_THROW(make_shapes(ShapeKind::Spheres, {}, {one, bad}, "mesh"), Error);
  EXPECT_THROW(make_shapes(ShapeKind::Spheres, {}, {one, nan}, "mesh"), Error);
  EXPECT_THROW(make_shapes(ShapeKind::Discs, {}, {one, good, one}, "mesh"), Error);
}

}  // namespace
}  // namespace ballot
