// Tests of the origins of secondary rays, with every offset policy.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>

#include "tests/device/harness.h"
#include "tools/verify/origin_scenes.h"

namespace ballot {
namespace {

class Origins : public testing::Test {
 protected:
  static std::unique_ptr<DeviceScene> open(Scene scene) {
    DeviceSceneOptions options{.device = "", .validate = true, .build = {}};
    options.use_cache = false;
    return std::make_unique<DeviceScene>(std::move(scene), options);
  }

  /// Returns large walls about a camera at the origin: at z = -2, at x = 0.02 and one at 45 degrees.
  static Scene walls() {
    Scene scene;
    scene.name = "walls";
    const auto quad = [&](glm::vec3 a, glm::vec3 b, glm::vec3 c, glm::vec3 d) {
      scene.triangles.push_back({a, b, c});
      scene.triangles.push_back({a, c, d});
    };
    quad({-9, -9, -2}, {9, -9, -2}, {9, 9, -2}, {-9, 9, -2});
    quad({0.02f, -9, -2}, {0.02f, 9, -2}, {0.02f, 9, 1}, {0.02f, -9, 1});
    quad({-9, 8.5f, 0.5f}, {9, 8.5f, 0.5f}, {9, 0.5f, -7.5f}, {-9, 0.5f, -7.5f});
    View view;
    view.name = "view";
    view.yfov = 1.5;
    scene.views = {view};
    finish_scene(scene);
    return scene;
  }

  /// Returns the point of a hit in float32, from its barycentric coordinates.
  static glm::vec3 point_of(const Triangle& t, const Hit& hit) {
    const float b0 = 1 - hit.u - hit.v;
    return b0 * t[0] + hit.u * t[1] + hit.v * t[2];
  }

  /// Returns the unit geometric normal on the side that the primary ray comes from.
  static glm::dvec3 normal_of(const Triangle& t, const Ray& primary) {
    const glm::dvec3 a(t[0]), n = glm::normalize(glm::cross(glm::dvec3(t[1]) - a, glm::dvec3(t[2]) - a));
    return glm::dot(n, glm::dvec3(primary.dir)) > 0 ? -n : n;
  }
};

/// A ray of a batch and the primary hit that it starts from.
struct Made {
  Ray ray;
  RayStart start;
};

std::vector<Made> make(DeviceScene& world, const char* kind, const RayKindOptions& options) {
  const auto batch = world.make_batch(world.scene().views[0], find_ray_kind(kind), 32, 32, options);
  const std::vector<Ray> rays = batch->rays();
  const std::vector<RayStart> starts = batch->starts();
  EXPECT_EQ(rays.size(), starts.size());
  std::vector<Made> all;
  for (std::size_t i = 0; i < rays.size(); ++i) all.push_back({rays[i], starts[i]});
  return all;
}

/// Returns a coordinate of Waechter and Binder's origin, written after the text of the chapter. The bits of the float,
/// taken as an integer, move by 256 times the normal's component, away from zero where both have the same sign. Within
/// 1/32 of zero, 2^-16 times the component is added instead.
float by_ulps(float p, float n) {
  if (std::abs(p) < 1.f / 32) return p + n / 65536.f;
  const int steps = int(256.f * n);
  return std::bit_cast<float>(std::bit_cast<std::int32_t>(p) + (p < 0 ? -steps : steps));
}

TEST_F(Origins, UlpIsWaechterAndBinders) {
  const auto world = open(walls());
  std::size_t near_zero = 0;
  for (const auto& [kind, side] : {std::pair{"reflect", 1.0}, {"refract", -1.0}, {"diffuse", 1.0}})
    for (const Made& m : make(*world, kind, {.offset = "ulp"})) {
      const Triangle& t = world->scene().triangles[m.start.hit.prim];
      const glm::vec3 p = point_of(t, m.start.hit), n(normal_of(t, m.start.primary) * side);
      for (int k = 0; k < 3; ++k) {
        ASSERT_EQ(m.ray.origin[k], by_ulps(p[k], n[k]))
            << kind << ", axis " << k << " of " << p[k] << " along " << n[k];
        near_zero += std::abs(p[k]) < 1.f / 32 && n[k] != 0;
      }
      ASSERT_EQ(m.ray.t_min, 0);
    }
  EXPECT_GT(near_zero, 100u);
  EXPECT_EQ(world->messages(), std::vector<std::string>{});
}

TEST_F(Origins, ConstantIsAShareOfTheDiagonal) {
  const auto world = open(walls());
  const Bounds& b = world->scene().bounds;
  for (const float share : {1e-4f, 1e-2f})
    for (const Made& m : make(*world, "reflect", {.offset = "constant", .constant_offset = share})) {
      const Triangle& t = world->scene().triangles[m.start.hit.prim];
      const glm::dvec3 want = glm::dvec3(point_of(t, m.start.hit)) +
                              normal_of(t, m.start.primary) * (double(share) * glm::distance(b.lo, b.hi));
      ASSERT_LT(glm::distance(glm::dvec3(m.ray.origin), want), 3e-6);
    }
}

// The origin lies on the normal's side of the plane, and with policy "bounded" farther away than with "pbrt".
TEST_F(Origins, ErrorBoundsLieOnTheRightSide) {
  const auto world = open(walls());
  for (const auto& [kind, side] : {std::pair{"reflect", 1.0}, {"refract", -1.0}}) {
    const auto pbrt = make(*world, kind, {.offset = "pbrt"}), bounded = make(*world, kind, {.offset = "bounded"});
    ASSERT_EQ(pbrt.size(), bounded.size());
    for (std::size_t i = 0; i < pbrt.size(); ++i) {
      const Triangle& t = world->scene().triangles[pbrt[i].start.hit.prim];
      const glm::dvec3 n = normal_of(t, pbrt[i].start.primary) * side;
      const double low = glm::dot(glm::dvec3(pbrt[i].ray.origin) - glm::dvec3(t[0]), n);
      const double high = glm::dot(glm::dvec3(bounded[i].ray.origin) - glm::dvec3(t[0]), n);
      ASSERT_GE(low, 0);  // 0 where a wall's coordinate is exact; the bound need not know that
      ASSERT_GT(high, low);
      ASSERT_LT(high, 1e-3);
    }
  }
}

TEST_F(Origins, ProvedAndBoundedHaveNoSelfHits) {
  const struct { double size, distance; } cases[] = {{1, 0}, {1e-6, 1}, {1e6, 1e2}, {1, 1e6}};
  for (const verify::OriginScene& scene : verify::origin_scenes())
    for (const auto& c : cases) {
      const auto world = open(scene.make(c.size, c.distance));
      std::size_t rays = 0, own = 0;
      for (const View& view : world->scene().views)
        for (const auto& [kind, offset] :
             {std::pair{"secondary", "proved"}, {"diffuse", "proved"}, {"secondary", "bounded"}}) {
          const auto batch = world->make_batch(view, find_ray_kind(kind), 64, 64, {.offset = offset});
          world->trace(*batch, {});
          const std::vector<Hit> hits = batch->hits();
          const std::vector<std::uint32_t> prims = batch->start_prims();
          ASSERT_EQ(hits.size(), prims.size());
          for (std::size_t i = 0; i < hits.size(); ++i) own += hits[i].prim == prims[i];
          rays += hits.size();
        }
      EXPECT_GT(rays, 0u) << scene.name << " of size " << c.size << " at " << c.distance;
      EXPECT_EQ(own, 0u) << scene.name << " of size " << c.size << " at " << c.distance << ", of " << rays;
      EXPECT_EQ(world->messages(), std::vector<std::string>{});
    }
}

// The scene has a gap of 1e-4 of its size. An offset of 1e-3 jumps over the far side of the gap; an offset of some ulps
// does not.
TEST_F(Origins, LostContactsAreSeen) {
  Scene scene;
  scene.name = "gap";
  for (const float z : {-1.f, -1.0001f}) {
    scene.triangles.push_back({glm::vec3{-1, -1, z}, {1, -1, z}, {1, 1, z}});
    scene.triangles.push_back({glm::vec3{-1, -1, z}, {1, 1, z}, {-1, 1, z}});
  }
  View view;
  view.name = "view";
  scene.views = {view};
  finish_scene(scene);
  const auto world = open(std::move(scene));
  const auto count = [&](const RayKindOptions& options) {
    const auto batch = world->make_batch(world->scene().views[0], find_ray_kind("refract"), 32, 32, options);
    const auto checks = world->check_origins(*batch);
    EXPECT_EQ(checks.size(), 1024u);
    return std::ranges::count_if(checks, [](const OriginCheck& c) { return c.lost_contact; });
  };
  EXPECT_EQ(count({.offset = "constant", .constant_offset = 1e-3f}), 1024);
  EXPECT_EQ(count({.offset = "constant", .constant_offset = 1e-6f}), 0);
  EXPECT_EQ(count({}), 0);
}

TEST_F(Origins, StartsAndBadOptions) {
  const auto world = open(walls());
  const View& view = world->scene().views[0];
  const auto primary = world->make_batch(view, find_ray_kind("primary"), 32, 32);
  EXPECT_TRUE(primary->start_prims().empty());
  EXPECT_THROW(world->check_origins(*primary), Error);
  world->trace(*primary, {});
  std::vector<std::uint32_t> want;
  for (const Hit& hit : primary->hits())
    if (hit.prim != NO_HIT) want.insert(want.end(), 3, hit.prim);
  EXPECT_EQ(world->make_batch(view, find_ray_kind("ao"), 32, 32, {.ao_rays = 3})->start_prims(), want);
  EXPECT_TRUE(world->make_batch("foreign", primary->rays(), Want::Nearest)->start_prims().empty());
  EXPECT_THROW(make(*world, "ao", {.constant_offset = 0}), Error);
  try {
    make(*world, "ao", {.offset = "none"});
    ADD_FAILURE() << "policy 'none' was accepted, expected an error";
  } catch (const Error& e) {
    EXPECT_STREQ(e.what(), "no offset policy is called 'none'; there are: constant, ulp, pbrt, proved, bounded");
  }
}

}  // namespace
}  // namespace ballot
