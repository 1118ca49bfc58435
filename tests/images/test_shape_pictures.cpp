// Pictures of shapes other than triangles: normals, distances, and light that no shape takes from itself.
#include "tests/cpu/shape_truth.h"
#include "tests/images/pictures.h"

namespace ballot::test {
namespace {

constexpr std::uint32_t kPixels = 32;
constexpr ShapeKind kKinds[] = {ShapeKind::Spheres, ShapeKind::Discs, ShapeKind::Capsules, ShapeKind::Boxes};
const glm::dvec3 kEye{0.1, 0.2, 3};

Shape one_of(ShapeKind kind) {
  switch (kind) {
    case ShapeKind::Discs:
      return {{0, 0, 0, 1}, {0.6f, 0, 0.8f, 0}};
    case ShapeKind::Capsules:
      return {{-0.5f, -0.3f, 0, 0.5f}, {0.6f, 0.4f, 0.2f, 0.3f}};
    case ShapeKind::Boxes:
      return {{-0.8f, -0.6f, -0.5f, 0}, {0.7f, 0.5f, 0.4f, 0}};
    default:
      return {{0, 0, 0, 1}, {}};
  }
}

Scene scene_with(std::vector<ShapeMesh> meshes, std::vector<Placement> placements) {
  Scene scene = scene_of(std::move(meshes), std::move(placements));
  scene.materials[0].base_color = {0.75f, 0.5f, 0.25f};
  scene.sky.kind = Sky::Kind::Constant;
  return scene;
}

/// A scene of all kinds, each in its place, where a view from kEye sees it alone.
struct Places {
  std::vector<ShapeMesh> meshes;
  std::vector<Placement> placements;
  std::vector<View> views;
  std::vector<ShapeKind> kinds;

  Places() {
    for (const ShapeKind kind : kKinds) meshes.push_back({kind, {one_of(kind)}});
  }
  void add(std::size_t kind, const Transform& place, const glm::dvec3& eye) {
    const glm::vec3 at(float(100 * placements.size()), 0, 0);
    Transform moved = place;
    moved.m[0][3] += at.x;
    placements.push_back({std::uint32_t(kind), moved});
    views.push_back(view_from(eye + glm::dvec3(at)));
    kinds.push_back(kKinds[kind]);
  }
  Scene scene() const {
    Scene made = scene_with(meshes, placements);
    made.views = views;
    return made;
  }
};

Transform scaled(float s) { return {{{s, 0, 0, 0}, {0, s, 0, 0}, {0, 0, s, 0}}}; }

/// Expects that a point of the shape where it was made, and the normal there, are those of its surface.
void expect_surface(ShapeKind kind, const glm::dvec3& at, const glm::dvec3& n) {
  const Shape s = one_of(kind);
  if (kind == ShapeKind::Discs) {
    EXPECT_NEAR(std::abs(glm::dot(n, glm::dvec3(s.b))), 1, 1e-6);
    EXPECT_NEAR(glm::dot(at, glm::dvec3(s.b)), 0, 2e-5);
    return;
  }
  const auto value = [&](const glm::dvec3& p) { return double(outside(kind, s, {p.x, p.y, p.z})); };
  EXPECT_NEAR(value(at), 0, 2e-5);              // at most 700 from zero
  EXPECT_NEAR(value(at + 0.1 * n), 0.1, 4e-5);  // the surface's normal is the shortest way out
}

// In place, and mirrored, turned and scaled.
TEST(ShapePictures, NormalsAndDistances) {
  const Transform moved{{{0, 1.25f, 0, 0.5f}, {1.25f, 0, 0, 0}, {0, 0, 1.25f, -0.25f}}};
  Places places;
  for (std::size_t k = 0; k < std::size(kKinds); ++k) places.add(k, {}, kEye), places.add(k, moved, kEye);
  DeviceScene world(places.scene(), with_validation());
  for (std::size_t i = 0; i < places.kinds.size(); ++i) {
    SCOPED_TRACE(info_of(places.kinds[i]).name);
    const View& view = world.scene().views[i];
    const Picture p = render(world, view, {.width = kPixels, .height = kPixels, .shading = "normals"});
    std::size_t found = 0;
    for (std::uint32_t y = 0; y < kPixels; ++y)
      for (std::uint32_t x = 0; x < kPixels; ++x) {
        if (p.prim(x, y) != i) continue;
        const glm::dvec3 dir = glm::normalize(glm::dvec3(plane_point(view, x + 0.5, y + 0.5, kPixels, kPixels), -1));
        glm::dvec3 at = kEye + dir * double(p.at("Z", x, y)), n(p.normal(x, y));
        EXPECT_LE(glm::dot(n, dir), 1e-6);
        EXPECT_LT(glm::length(p.color(x, y) - (glm::vec3(n) * 0.5f + 0.5f)), 1e-5f);
        if (i % 2) at = glm::dvec3(at.y, at.x - 0.5, at.z + 0.25) / 1.25, n = glm::dvec3(n.y, n.x, n.z);
        expect_surface(places.kinds[i], at, n);
        ++found;
      }
    EXPECT_GT(found, kPixels * kPixels / 20);
  }
}

/// Expects that each pixel that sees a shape has this colour.
void expect_color(DeviceScene& world, const View& view, const RenderOptions& options, const glm::vec3& color) {
  const Picture p = render(world, view, options);
  std::size_t found = 0, other = 0;
  for (std::uint32_t y = 0; y < options.height; ++y)
    for (std::uint32_t x = 0; x < options.width; ++x) {
      if (p.at("A", x, y) < 1) continue;
      ++found;
      other += glm::length(p.color(x, y) - color) > 1e-3f;
    }
  EXPECT_GT(found, 30u) << options.shading;
  EXPECT_EQ(other, 0u) << options.shading;
}

// Rays that leave a convex shape do not meet it again, be it small, large, far away or far from zero.
TEST(ShapePictures, AConvexShapeHasNoShadowOnItself) {
  Places places;
  for (std::size_t k = 0; k < std::size(kKinds); ++k)
    for (const float s : {1e-3f, 1.f, 30.f}) places.add(k, scaled(s), kEye * double(s));
  places.add(0, {}, {0, 0, 1000});
  places.views.back().yfov = 0.003;
  DeviceScene world(places.scene(), with_validation());
  const float diagonal = glm::distance(world.scene().bounds.lo, world.scene().bounds.hi);
  for (const View& view : places.views)
    expect_color(world, view,
                 {.width = kPixels, .height = kPixels, .spp = 4, .shading = "ao", .ao_radius = 5 / diagonal},
                 glm::vec3(1));
  const glm::vec3 away(2e4f, -1e4f, 3e4f);
  Scene far = scene_with({{ShapeKind::Boxes, {one_of(ShapeKind::Boxes)}}}, {{0, scaled(1)}});
  for (int k = 0; k < 3; ++k) far.instances.placements[0].transform.m[k][3] = away[k];
  far.views = {view_from(kEye + glm::dvec3(away))};
  finish_scene(far);
  DeviceScene there(std::move(far), with_validation());
  expect_color(there, there.scene().views[0], {.width = kPixels, .height = kPixels, .spp = 4, .shading = "ao"},
               glm::vec3(1));
}

// The sky lights a convex shape alone from all sides.
TEST(ShapePictures, AShapeUnderTheSkyHasItsColor) {
  Scene scene = scene_with({{ShapeKind::Capsules, {one_of(ShapeKind::Capsules)}}}, {{0}});
  scene.views = {view_from(kEye)};
  DeviceScene world(std::move(scene), with_validation());
  for (const char* shading : {"path", "whitted"})
    expect_color(world, world.scene().views[0], {.width = kPixels, .height = kPixels, .spp = 4, .shading = shading},
                 {0.75f, 0.5f, 0.25f});
}

/// A floor of triangles with normals and colours, a ball of glass and a shining rod above it.
Scene still_life() {
  const shapes::Triangles floor = {{glm::vec3(-2, -1, -2), glm::vec3(-2, -1, 2), glm::vec3(2, -1, 2)},
                                   {glm::vec3(-2, -1, -2), glm::vec3(2, -1, 2), glm::vec3(2, -1, -2)}};
  ShapeMesh mesh;
  mesh.triangles.assign(floor.begin(), floor.end());
  Scene scene = scene_of({mesh,
                          {ShapeKind::Spheres, {one_of(ShapeKind::Spheres)}},
                          {ShapeKind::Capsules, {{{-1.5f, -0.5f, 0, 0.2f}, {-1.2f, 1, 0.5f, 0.1f}}}}},
                         {{0}, {1}, {2}});
  scene.normals.assign(4, {});
  scene.normals[0].fill(glm::vec3(0, 1, 0)), scene.normals[1].fill(glm::vec3(0, 1, 0));
  scene.colors.assign(4, {});
  for (auto& corners : scene.colors) corners.fill(glm::vec4(0.5f, 1, 1, 1));
  scene.materials = {{.name = "floor", .base_color = glm::vec3(0.5f)},
                     {.name = "glass", .roughness = 0, .transmission = 1},
                     {.name = "lamp", .emissive = glm::vec3(3)}};
  scene.material_of = {0, 0, 1, 2};
  scene.views = {view_from({0, 0.5, 4})};
  scene.sky.kind = Sky::Kind::Constant;
  finish_scene(scene);
  return scene;
}

TEST(ShapePictures, MethodsMakeOnePictureOfAMixedSceneAsDoesTheViewer) {
  DeviceScene world(still_life(), with_validation());
  const View view = world.scene().views[0];
  RenderOptions options{.width = kPixels, .height = kPixels, .spp = 2, .shading = "path"};
  const Picture first = render(world, view, options);
  for (const float value : first.image.channel("G").floats) ASSERT_TRUE(std::isfinite(value));
  for (const char* method : {"if-if", "bvh4-turns"}) {
    options.query.method = method;
    EXPECT_EQ(render(world, view, options).image.channel("G").floats, first.image.channel("G").floats) << method;
  }
  const std::uint32_t middle = kPixels / 2;
  EXPECT_EQ(first.prim(middle, middle), 2u);
  EXPECT_GT(first.color(middle, middle).g, 0.3f);  // through the glass

  LiveOptions live;
  live.width = live.height = kPixels;
  live.shading = "normals";
  world.live().add_sample(view, live);
  std::vector<std::uint32_t> shown(std::size_t(kPixels) * kPixels);
  world.live().pixels().download(shown);
  const Picture still = render(world, view, {.width = kPixels, .height = kPixels, .shading = "normals"});
  for (std::size_t i = 0; i < shown.size(); ++i)
    EXPECT_LE(std::abs(srgb(still.image.channel("G").floats[i]) - int(shown[i] >> 8 & 255)), 1) << i;
}

}  // namespace
}  // namespace ballot::test
