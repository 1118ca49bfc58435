// Tests on a finely divided sphere: silhouette, distance, flat and smooth normals, and that every method renders the
// same picture.
#include <algorithm>
#include <cstring>

#include "tests/cpu/shapes.h"
#include "tests/images/pictures.h"

namespace ballot::test {
namespace {

constexpr double kDistance = 3, kSag = 1e-3;  // the faces lie at most this far below the unit sphere

Scene sphere_scene(bool smooth) {
  Scene scene;
  scene.name = "sphere";
  scene.triangles = shapes::sphere(5);
  if (smooth)
    scene.normals.assign(scene.triangles.begin(), scene.triangles.end());  // the corners are their own normals
  scene.views.push_back(view_from({0, 0, kDistance}));
  finish_scene(scene);
  return scene;
}

/// Calls check(x, y, ray) for every pixel; `ray` is the unit direction of its camera ray.
template <class Check>
void each_pixel(const Picture& p, const View& view, Check&& check) {
  for (std::uint32_t y = 0; y < p.image.height; ++y)
    for (std::uint32_t x = 0; x < p.image.width; ++x)
      check(x, y, glm::normalize(glm::dvec3(plane_point(view, x + 0.5, y + 0.5, p.image.width, p.image.height), -1)));
}

void expect_silhouette(const Picture& p, const View& view) {
  // Bounds of the sine of the angle at which the sphere ends.
  const double most = 1 / kDistance, least = (1 - kSag) / kDistance;
  std::size_t inside = 0;
  each_pixel(p, view, [&](std::uint32_t x, std::uint32_t y, const glm::dvec3& ray) {
    const double sine = std::hypot(ray.x, ray.y);
    EXPECT_TRUE(sine <= most || p.at("A", x, y) == 0) << x << ", " << y;
    EXPECT_TRUE(sine >= least || p.at("A", x, y) == 1) << x << ", " << y;
    inside += p.at("A", x, y) == 1;
  });
  EXPECT_GT(inside, 100u);
}

void expect_surface(const Picture& p, const View& view, float normal_error) {
  each_pixel(p, view, [&](std::uint32_t x, std::uint32_t y, const glm::dvec3& ray) {
    if (p.at("A", x, y) == 0) return;
    const glm::dvec3 point = glm::dvec3(0, 0, kDistance) + ray * double(p.at("Z", x, y));
    EXPECT_LT(glm::length(point), 1 + 1e-5) << x << ", " << y;
    EXPECT_GT(glm::length(point), 1 - kSag) << x << ", " << y;
    const glm::vec3 normal = p.normal(x, y);
    EXPECT_NEAR(glm::length(normal), 1, 1e-5);
    if (glm::dot(-ray, point) < 0.1) return;  // at the rim the face decides which side the normal is on
    EXPECT_LT(glm::length(normal - glm::vec3(glm::normalize(point))), normal_error) << x << ", " << y;
    EXPECT_NEAR(p.at("R", x, y), std::abs(glm::dot(glm::dvec3(normal), ray)), 1e-4);
  });
}

TEST(Sphere, SilhouetteDistanceAndNormals) {
  for (const bool smooth : {false, true}) {
    SCOPED_TRACE(smooth ? "smooth" : "flat");
    DeviceScene world(sphere_scene(smooth), with_validation());
    const View& view = world.scene().views[0];
    const Picture p = render(world, view, {.width = 101, .height = 77});
    expect_silhouette(p, view);
    expect_surface(p, view, smooth ? 2e-3f : 0.05f);
  }
}

TEST(Sphere, NormalsAsColour) {
  DeviceScene world(sphere_scene(true), with_validation());
  const Picture p = render(world, world.scene().views[0], {.width = 50, .height = 50, .shading = "normals"});
  for (std::uint32_t y = 0; y < 50; ++y)
    for (std::uint32_t x = 0; x < 50; ++x) {
      const glm::vec3 expected = p.prim(x, y) == NO_HIT ? glm::vec3(0) : p.normal(x, y) * 0.5f + 0.5f;
      EXPECT_LT(glm::length(p.color(x, y) - expected), 1e-6f);
    }
}

TEST(Sphere, NoHoleInAClosedSurface) {
  Scene scene = sphere_scene(false);
  scene.views[0] = view_from({0.1, -0.2, 0.3});
  scene.views[0].yfov = 2.8;
  const Picture p = render(std::move(scene), {.width = 300, .height = 300});
  for (const float alpha : p.image.channel("A").floats) ASSERT_EQ(alpha, 1);
}

void expect_same(const Image& a, const Image& b) {
  ASSERT_EQ(a.channels.size(), b.channels.size());
  for (const Channel& c : a.channels) {
    const Channel& d = b.channel(c.name);
    EXPECT_EQ(c.uints, d.uints) << c.name;
    ASSERT_EQ(c.floats.size(), d.floats.size());
    EXPECT_TRUE(c.floats.empty() || !std::memcmp(c.floats.data(), d.floats.data(), c.floats.size() * sizeof(float)))
        << c.name;
  }
}

// In the default numeric mode a picture does not depend on the method, nor on the kernel configuration of some. In the
// other conservative modes the default method makes the same picture twice.
TEST(Sphere, OnePictureForEveryMethodAndKnob) {
  Scene scene = sphere_scene(true);
  // Overlapping triangles, whose order could be wrong.
  for (Triangle t : shapes::soup(400, 0.3f)) scene.triangles.push_back(t);
  scene.normals.resize(scene.triangles.size(), {glm::vec3(0, 0, 1), glm::vec3(0, 0, 1), glm::vec3(0, 0, 1)});
  scene.material_of.assign(scene.triangles.size(), 0);
  finish_scene(scene);
  DeviceScene world(std::move(scene), with_validation());
  const View& view = world.scene().views[0];
  for (const NumericMode& mode : kNumericModes) {
    if (!mode.conservative) continue;
    RenderOptions options{.width = 100, .height = 50, .spp = 2};
    options.query.numeric = mode.name;
    const Picture first = render(world, view, options);
    for (const Method& method : kMethods)
      for (const Knobs& knobs :
           {Knobs{}, Knobs{{"launch", "persistent"}}, Knobs{{"layout", "paper"}, {"fetch", "storage"}},
            Knobs{{"vote", "any"}}, Knobs{{"vote", "sum"}, {"workgroup", "128"}, {"stack", "private"}}}) {
        if (mode.name != kDefaultNumeric && (method.name != kDefaultMethod || !knobs.empty())) continue;
        if (!knobs.empty() && method.name != (knobs.contains("vote") ? "packet" : kPlainestMethod)) continue;
        options.query.method = method.name;
        options.query.knobs = knobs;
        SCOPED_TRACE(world.tracer().variant(options.query).name());
        expect_same(render(world, view, options).image, first.image);
      }
  }
}

}  // namespace
}  // namespace ballot::test
