// Holds crossings that leave out transparent surfaces to a brute-force oracle: exact crossings of all triangles, and
// textures that are sampled in double precision.
#include <cmath>

#include "engine/core/error.h"
#include "tests/device/crossing_test.h"

namespace ballot {
namespace {

constexpr std::uint32_t kSide = 8;  // texels of the image
constexpr double kNear = 2e-3;      // alphas and texel borders that are nearer than this are left to rounding

/// What the oracle says of a surface at a point.
enum class Stops { No, Yes, Unsure };

double wrapped_alpha(const Scene& scene, const Texture& texture, int x, int y) {
  const auto wrap = [](int at, Wrap mode) {
    const int side = int(kSide);
    if (mode == Wrap::Clamp) return std::clamp(at, 0, side - 1);
    const int period = mode == Wrap::Mirror ? 2 * side : side, in = (at % period + period) % period;
    return in < side ? in : period - 1 - in;
  };
  const int column = wrap(x, texture.wrap_u), row = wrap(y, texture.wrap_v);
  return scene.images[0].rgba[std::size_t(row * int(kSide) + column) * 4 + 3] / 255.0;
}

/// Returns the alpha of a texture; NaN at the border of a texel that is not interpolated.
double texture_alpha(const Scene& scene, const Texture& texture, const glm::dvec2& uv) {
  glm::dvec2 at = uv * double(kSide);
  if (texture.nearest) {
    if (std::abs(at.x - std::round(at.x)) < kNear || std::abs(at.y - std::round(at.y)) < kNear) return NAN;
    return wrapped_alpha(scene, texture, int(std::floor(at.x)), int(std::floor(at.y)));
  }
  at -= 0.5;
  const int x = int(std::floor(at.x)), y = int(std::floor(at.y));
  const double s = at.x - x, t = at.y - y;
  const auto texel = [&](int dx, int dy) { return wrapped_alpha(scene, texture, x + dx, y + dy); };
  return (1 - t) * ((1 - s) * texel(0, 0) + s * texel(1, 0)) + t * ((1 - s) * texel(0, 1) + s * texel(1, 1));
}

Stops stops(const Scene& scene, const Hit& hit) {
  const Material& m = scene.materials[scene.material(hit.prim)];
  if (m.alpha_mode == Alpha::Opaque) return Stops::Yes;
  const double u = hit.u, v = hit.v;
  double alpha = m.alpha;
  if (m.base_texture) {
    const auto& c = scene.uvs[m.base_texture.set][hit.prim];
    const glm::dvec2 uv = glm::dvec2(c[0]) * (1 - u - v) + glm::dvec2(c[1]) * u + glm::dvec2(c[2]) * v;
    const glm::dvec3 one(uv, 1);
    alpha *= texture_alpha(
        scene, scene.textures[m.base_texture.texture],
        {glm::dot(glm::dvec3(m.base_texture.row_u), one), glm::dot(glm::dvec3(m.base_texture.row_v), one)});
  }
  const auto& colors = scene.colors[hit.prim];
  alpha *= double(colors[0].a) * (1 - u - v) + double(colors[1].a) * u + double(colors[2].a) * v;
  if (m.alpha_mode == Alpha::Blend) return std::isnan(alpha) ? Stops::Unsure : alpha > 0 ? Stops::Yes : Stops::No;
  const double over = alpha - double(m.alpha_cutoff);
  return !(std::abs(over) > kNear) ? Stops::Unsure : over > 0 ? Stops::Yes : Stops::No;
}

/// Returns layers of a square, one behind the other, each of another material.
Scene layers() {
  Scene scene;
  scene.name = "layers";
  shapes::Random random(3);
  TextureImage image{.name = "holes", .width = kSide, .height = kSide};
  for (std::uint32_t i = 0; i < kSide * kSide * 4; ++i)
    image.rgba.push_back(std::uint8_t(i % 8 == 3 ? 0 : random.in(0, 255.99f)));
  scene.images.push_back(std::move(image));
  scene.textures = {{.nearest = true}, {.wrap_u = Wrap::Mirror, .wrap_v = Wrap::Clamp}};
  const auto material = [&](Alpha mode, float alpha, float cutoff, std::uint32_t texture) {
    Material m;
    m.alpha_mode = mode, m.alpha = alpha, m.alpha_cutoff = cutoff, m.base_texture.texture = texture;
    m.base_texture.row_u = {0.5f, 1, 0.25f};
    scene.materials.push_back(m);
  };
  material(Alpha::Opaque, 0, 0.5f, 0);
  material(Alpha::Mask, 1, 0.5f, 0);
  material(Alpha::Mask, 0.8f, 0.3f, 1);
  material(Alpha::Blend, 0.5f, 0.5f, 0);
  material(Alpha::Mask, 1, 0.5f, kNoTexture);
  material(Alpha::Mask, 0.25f, 0.5f, kNoTexture);
  for (std::uint32_t layer = 0; layer < 18; ++layer)
    for (const bool upper : {false, true}) {
      const float z = float(layer), s = upper ? -1.f : 1.f;
      scene.triangles.push_back({{{-s, -s, z}, {s, -s, z}, {-s, s, z}}});
      scene.material_of.push_back(layer % 6);
      scene.uvs[0].push_back({glm::vec2(-s, -s), glm::vec2(s, -s), glm::vec2(-s, s)});
      const bool fades = layer % 6 == 4;
      scene.colors.push_back({glm::vec4(1), glm::vec4(1, 1, 1, fades ? 0 : 1), glm::vec4(1)});
    }
  finish_scene(scene);
  return scene;
}

class CrossingAlpha : public CrossingTest {
 protected:
  DeviceScene world_{layers(), {.device = "", .validate = true, .build = {}, .use_cache = false}};
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
  Scene scene = layers();
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
