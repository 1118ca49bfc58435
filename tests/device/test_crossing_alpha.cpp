// Holds crossings that leave out transparent surfaces to a brute-force oracle: exact crossings of all triangles, and
// textures that are sampled in double precision.
#include <cmath>

#include "engine/core/error.h"
#include "tests/device/crossing_test.h"
#include "tests/device/layers.h"

namespace ballot {
namespace {

constexpr double kNear = 2e-3;  // alphas and texel borders that are nearer than this are left to rounding

/// What the oracle says of a surface at a point.
enum class Stops { No, Yes, Unsure };

Stops stops(const Scene& scene, const Hit& hit) {
  const Material& m = scene.materials[scene.material(hit.prim)];
  if (m.alpha_mode == Alpha::Opaque) return Stops::Yes;
  const double u = hit.u, v = hit.v;
  double alpha = m.alpha;
  if (m.base_texture) {
    alpha *= layers::texture_at(scene, m.base_texture, hit.prim, u, v, kNear).a;
  }
  const auto& colors = scene.colors[hit.prim];
  alpha *= double(colors[0].a) * (1 - u - v) + double(colors[1].a) * u + double(colors[2].a) * v;
  if (m.alpha_mode == Alpha::Blend) return std::isnan(alpha) ? Stops::Unsure : alpha > 0 ? Stops::Yes : Stops::No;
  const double over = alpha - double(m.alpha_cutoff);
  return !(std::abs(over) > kNear) ? Stops::Unsure : over > 0 ? Stops::Yes : Stops::No;
}

class CrossingAlpha : public CrossingTest {
 protected:
  DeviceScene world_{layers::scene(), {.device = "", .validate = true, .build = {}, .use_cache = false}};
};

TEST_F(CrossingAlpha, LeavesOutWhatStopsNothing) {
  const Scene& scene = world_.scene();
  RayQueries& queries = world_.rays();
  std::vector<Ray> rays;
  for (const Ray& r : shapes::random_rays(1500, 5, 0.5f))
    rays.push_back({{r.origin.x, r.origin.y, -1}, 0, {0.02f * r.dir.x, 0.02f * r.dir.y, 1}, 1e6f});
  for (const Cull cull : {Cull::None, Cull::Front}) {
    CrossingQuery query{.cull = cull};
    const auto whole = lists(queries, rays, query);
    query.alpha = true;
    const auto numbers = counts(queries, rays, query);
    const auto found = lists(queries, rays, query);
    expect_first(queries, rays, found, query);
    std::size_t unsure = 0, left_out = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      ASSERT_EQ(prims_of(whole[i]), crossings_of(rays[i], scene.triangles, cull == Cull::None ? 0 : 1)) << i;
      ASSERT_EQ(numbers[i], found[i].size()) << i;
      std::vector<std::uint32_t> truth;
      bool open = false;
      for (const Hit& h : whole[i]) {
        const Stops answer = stops(scene, h);
        open = open || answer == Stops::Unsure;
        if (answer == Stops::Yes) truth.push_back(h.prim);
        left_out += answer == Stops::No;
      }
      unsure += open;
      if (!open) {
        ASSERT_EQ(prims_of(found[i]), truth) << i;
      }
    }
    EXPECT_LT(unsure, rays.size() / 4);
    EXPECT_GT(left_out, 6000u);
  }
  EXPECT_EQ(world_.messages(), std::vector<std::string>{});
}

TEST_F(CrossingAlpha, IsRefusedInModeExact) {
  const std::vector<Ray> rays = shapes::random_rays(3);
  EXPECT_THROW(counts(world_.rays(), rays, {.exact = true, .alpha = true}), Error);
}

// The kernel is the one without alpha, and the scene's materials are not uploaded.
TEST_F(CrossingAlpha, OpaqueScenesAreAsTheyAre) {
  Scene scene = layers::scene();
  for (Material& m : scene.materials) m.alpha_mode = Alpha::Opaque;
  DeviceScene opaque(std::move(scene), {.device = "", .validate = true, .build = {}, .use_cache = false});
  const Ray rays[] = {{{0.25f, 0.125f, -1}, 0, {0, 0, 1}, 1e6f}};
  EXPECT_EQ(counts(opaque.rays(), rays, {.alpha = true}), (std::vector<std::uint32_t>{18}));
  EXPECT_EQ(opaque.render_bytes(), 0u);
  EXPECT_LT(counts(world_.rays(), rays, {.alpha = true})[0], 18u);
  EXPECT_GT(world_.render_bytes(), 0u);
}

}  // namespace
}  // namespace ballot
