// Holds columns of surfaces to the scene: materials, colours by textures that are sampled in double precision, normals
// of vertices and of normal maps.
#include <cmath>
#include <glm/geometric.hpp>

#include "tests/device/fixture.h"
#include "tests/device/forests.h"
#include "tests/device/layers.h"

namespace ballot {
namespace {

constexpr double kNear = 2e-3;

class SurfaceColumnsTest : public DeviceTest {
 protected:
  struct Columns {
    std::vector<Hit> hits;
    std::vector<std::uint32_t> materials;
    std::vector<glm::vec4> colors;
    std::vector<glm::vec3> normals;
  };

  /// Returns the columns of hits; `flat` are the normals of their triangles.
  static Columns columns(DeviceScene& world, std::vector<Hit> hits, const std::vector<glm::vec3>& flat) {
    Context& gpu = *world.context();
    const std::size_t n = hits.size();
    Buffer<Hit> found(gpu, n, Access::Storage, "hits");
    Buffer<std::uint32_t> materials(gpu, n, Access::Storage, "materials");
    Buffer<glm::vec4> colors(gpu, n, Access::Storage, "colors");
    Buffer<glm::vec3> normals(gpu, n, Access::Storage, "normals");
    found.upload(hits), normals.upload(flat);
    ColumnBuffers to{};
    to[COLUMN_MATERIALS] = &materials, to[COLUMN_COLORS] = &colors, to[COLUMN_SHADING_NORMALS] = &normals;
    world.surface_columns().record({.found = found, .count = n}, to, {});
    gpu.finish();
    Columns all{std::move(hits), std::vector<std::uint32_t>(n), std::vector<glm::vec4>(n), std::vector<glm::vec3>(n)};
    materials.download(all.materials), colors.download(all.colors), normals.download(all.normals);
    return all;
  }

  /// Returns hits all over triangles of the scene, and a miss.
  static std::vector<Hit> hits_of(std::uint64_t triangles, std::size_t n) {
    shapes::Random random(9);
    std::vector<Hit> hits{{INFINITY, NO_HIT, 0, 0}};
    while (hits.size() < n) {
      const float u = random.in(0, 1), v = random.in(0, 1);
      if (u + v < 1) hits.push_back({1, std::uint32_t(hits.size() % triangles), u, v});
    }
    return hits;
  }
};

/// Holds the colours of hits on triangles of the scene's arrays, as triangle_of() numbers them, to the oracle.
template <class TriangleOf>
void expect_colors(const Scene& scene, std::span<const Hit> hits, std::span<const glm::vec4> colors,
                   std::span<const std::uint32_t> materials, const TriangleOf& triangle_of) {
  std::size_t open = 0;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (hits[i].prim == NO_HIT) {
      EXPECT_EQ(colors[i], glm::vec4(0));
      EXPECT_EQ(materials[i], NO_HIT);
      continue;
    }
    const std::size_t triangle = triangle_of(hits[i].prim);
    const double u = hits[i].u, v = hits[i].v;
    ASSERT_EQ(materials[i], scene.material(triangle)) << i;
    const Material& m = scene.materials[materials[i]];
    glm::dvec4 truth(m.base_color, m.alpha);
    if (m.base_texture) truth *= layers::texture_at(scene, m.base_texture, triangle, u, v, kNear);
    const auto& c = scene.colors[triangle];
    truth *= glm::dvec4(c[0]) * (1 - u - v) + glm::dvec4(c[1]) * u + glm::dvec4(c[2]) * v;
    const double over = truth.a - double(m.alpha_cutoff);
    if (m.alpha_mode == Alpha::Opaque) truth.a = 1;
    const bool is_open = std::isnan(truth.r) || (m.alpha_mode == Alpha::Mask && std::abs(over) < kNear);
    open += is_open;
    if (is_open) continue;
    if (m.alpha_mode == Alpha::Mask) truth.a = over < 0 ? 0 : 1;
    for (int k = 0; k < 4; ++k) ASSERT_NEAR(colors[i][k], truth[k], 2e-3) << i << " " << k;
  }
  EXPECT_LT(open, hits.size() / 8);
}

TEST_F(SurfaceColumnsTest, HaveTheColoursOfMaterials) {
  DeviceScene world(layers::scene(), {.device = "", .validate = true, .build = {}, .use_cache = false});
  const Scene& scene = world.scene();
  const std::vector<Hit> hits = hits_of(scene.triangles.size(), 3000);
  const std::vector<glm::vec3> flat(hits.size(), glm::vec3(0, 0, 1));
  const Columns found = columns(world, hits, flat);
  expect_colors(scene, hits, found.colors, found.materials, [](std::uint32_t prim) { return prim; });
  EXPECT_EQ(found.normals, flat);  // the scene has no others
  EXPECT_EQ(world.messages(), std::vector<std::string>{});
}

// Instances number the triangles of those that are hidden, too.
TEST_F(SurfaceColumnsTest, FollowInstances) {
  Scene scene = layers::scene();
  for (std::size_t i = 0; i < scene.triangles.size(); ++i)
    scene.normals.push_back({glm::vec3(0.6f, 0, 0.8f), glm::vec3(-0.6f, 0, 0.8f), glm::vec3(0, 0.6f, 0.8f)});
  const std::size_t count = scene.triangles.size();
  scene.instances = {};
  scene.instances.first = {0, 6, count};
  const Transform turned = forests::turned(0.5f, 1, {2, 0.5f, 1}, {1, 2, 3}), mirror = [] {
    Transform t = forests::moved({0, 0, 5});
    t.m[0][0] = -1;
    return t;
  }();
  scene.instances.placements = {{0, turned, 0}, {1, forests::moved({0, 0, 9})}, {0, turned}, {1, mirror}};
  finish_scene(scene);
  DeviceScene world(std::move(scene), {.device = "", .validate = true, .build = {}, .use_cache = false});
  const Scene& now = world.scene();
  std::vector<std::size_t> triangle_of, placement_of;
  for (std::size_t p = 0; p < now.instances.placements.size(); ++p)
    for (std::size_t i = now.instances.first[now.instances.placements[p].mesh];
         i < now.instances.first[now.instances.placements[p].mesh + 1]; ++i)
      triangle_of.push_back(i), placement_of.push_back(p);
  std::vector<Hit> hits = hits_of(triangle_of.size(), 3000);
  std::erase_if(hits, [](const Hit& h) { return h.prim < 6; });  // of the hidden one
  std::vector<glm::vec3> flat;
  for (const Hit& h : hits) {
    const Triangle t = h.prim == NO_HIT ? Triangle{} : world.triangle(h.prim);
    flat.push_back(h.prim == NO_HIT ? glm::vec3(0) : glm::normalize(glm::cross(t[1] - t[0], t[2] - t[0])));
  }
  const Columns found = columns(world, hits, flat);
  expect_colors(now, hits, found.colors, found.materials, [&](std::uint32_t prim) { return triangle_of[prim]; });
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (hits[i].prim == NO_HIT) {
      EXPECT_EQ(found.normals[i], glm::vec3(0));
      continue;
    }
    const Transform& at = now.instances.placements[placement_of[hits[i].prim]].transform;
    glm::dmat3 m;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) m[c][r] = at.m[r][c];
    const auto& n = now.normals[triangle_of[hits[i].prim]];
    const double w[]{1.0 - hits[i].u - hits[i].v, hits[i].u, hits[i].v};
    glm::dvec3 truth(0);
    for (int k = 0; k < 3; ++k) truth += w[k] * glm::normalize(glm::transpose(glm::inverse(m)) * glm::dvec3(n[k]));
    truth = glm::normalize(truth);
    if (glm::dot(truth, glm::dvec3(flat[i])) < 0) truth = -truth;
    ASSERT_LT(glm::length(glm::dvec3(found.normals[i]) - truth), 2e-5) << i;
  }
  EXPECT_EQ(world.messages(), std::vector<std::string>{});
}

// A normal map of one colour bends all normals alike.
TEST_F(SurfaceColumnsTest, NormalMapsBend) {
  Scene scene = layers::scene();
  std::ranges::fill(scene.images[0].rgba, std::uint8_t(128));
  for (std::size_t i = 0; i < scene.images[0].rgba.size(); i += 4) scene.images[0].rgba[i] = 255;
  for (Material& m : scene.materials) m.base_texture = {}, m.normal_texture = {.texture = 0};
  scene.instances = {};
  finish_scene(scene);
  DeviceScene world(std::move(scene), {.device = "", .validate = true, .build = {}, .use_cache = false});
  const std::vector<Hit> hits = hits_of(world.scene().triangles.size(), 500);
  std::vector<glm::vec3> flat(hits.size(), glm::vec3(0, 0, 1));
  flat[0] = glm::vec3(0);
  const Columns found = columns(world, hits, flat);
  EXPECT_EQ(found.normals[0], glm::vec3(0));
  for (std::size_t i = 1; i < hits.size(); ++i) {  // x of the map runs along x of the layers
    EXPECT_GT(found.normals[i].x, 0.9f) << i;
    EXPECT_NEAR(glm::length(found.normals[i]), 1, 1e-5) << i;
  }
  EXPECT_EQ(world.messages(), std::vector<std::string>{});
}

}  // namespace
}  // namespace ballot
