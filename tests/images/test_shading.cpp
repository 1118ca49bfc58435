// Tests of shading: materials, emission, background, the orientation of pictures, and that kernels hold no needless
// code.
#include "engine/gpu/kernel.h"
#include "shaders/shared/render.h"
#include "tests/images/pictures.h"

namespace ballot::test {
namespace {

const glm::vec3 kRed(1, 0, 0), kGreen(0, 1, 0), kBlue(0, 0, 1), kWhite(1);

/// Returns a scene with a coloured square in each quarter of the view. To the camera, at +z, right is +x and up is +y.
Scene quarters() {
  Scene scene;
  scene.name = "quarters";
  for (const glm::vec3& color : {kRed, kGreen, kBlue, kWhite})
    scene.materials.push_back({.name = "paint", .base_color = color});
  add_rectangle(scene, {-1, 0}, {0, 1}, 0, 0);   // top left: red
  add_rectangle(scene, {0, 0}, {1, 1}, 0, 1);    // top right: green
  add_rectangle(scene, {-1, -1}, {0, 0}, 0, 2);  // bottom left: blue
  add_rectangle(scene, {0, -1}, {1, 0}, 0, 3);   // bottom right: white
  scene.views.push_back(view_from({0, 0, 3}));
  finish_scene(scene);
  return scene;
}

/// Returns the colour of the pixel that lies an eighth of the picture right or left of its middle, and below or above
/// it. The colour is scaled to a largest channel of 1, which removes the cosine of shading eyelight.
glm::vec3 hue(const Picture& p, bool right, bool bottom) {
  const std::uint32_t w = p.image.width, h = p.image.height;
  const glm::vec3 c = p.color(w / 2 + (right ? 1 : -1) * (w / 8), h / 2 + (bottom ? 1 : -1) * (h / 8));
  return c / std::max(c.r, std::max(c.g, c.b));
}

TEST(Shading, PixelZeroIsTopLeftAndEachTriangleHasItsMaterial) {
  const Picture p = render(quarters(), {.width = 96, .height = 64});
  EXPECT_EQ(hue(p, false, false), kRed);
  EXPECT_EQ(hue(p, true, false), kGreen);
  EXPECT_EQ(hue(p, false, true), kBlue);
  EXPECT_EQ(hue(p, true, true), kWhite);
}

TEST(Shading, ARolledCameraTurnsThePicture) {
  Scene scene = quarters();
  // The camera's right is the world's up; the camera's up is the world's left.
  scene.views[0] = view_from({0, 0, 3}, glm::rotate(glm::dmat4(1), glm::radians(90.0), glm::dvec3(0, 0, 1)));
  const Picture p = render(std::move(scene), {.width = 64, .height = 64});
  EXPECT_EQ(hue(p, false, false), kBlue);
  EXPECT_EQ(hue(p, true, false), kRed);
  EXPECT_EQ(hue(p, false, true), kWhite);
  EXPECT_EQ(hue(p, true, true), kGreen);
}

TEST(Shading, OrthographicHasTheSameOrientation) {
  Scene scene = quarters();
  scene.views[0].orthographic = true;
  scene.views[0].ymag = 1.5;
  const Picture p = render(std::move(scene), {.width = 96, .height = 64});
  EXPECT_EQ(hue(p, false, false), kRed);
  EXPECT_EQ(hue(p, true, false), kGreen);
  EXPECT_EQ(hue(p, false, true), kBlue);
  EXPECT_EQ(hue(p, true, true), kWhite);
}

TEST(Shading, EmissionIsAddedAndKeepsItsRange) {
  Scene scene;
  scene.name = "lamp";
  scene.materials.push_back({.name = "lamp", .base_color = {0.5f, 0, 0}, .emissive = {0.25f, 3, 4096}});
  add_rectangle(scene, {-1, -1}, {1, 1}, 0);
  scene.views.push_back(view_from({0, 0, 3}));
  finish_scene(scene);
  DeviceScene world(std::move(scene), with_validation());
  for (const std::uint32_t spp : {1u, 8u}) {
    View view = world.scene().views[0];
    view.orthographic = true;
    view.ymag = 0.5;  // the square fills the picture, and the cosine is 1 everywhere
    const Picture p = render(world, view, {.width = 5, .height = 5, .spp = spp});
    EXPECT_LT(glm::length(p.color(2, 2) - glm::vec3(0.75f, 3, 4096)), 1e-3f) << spp;
  }
}

TEST(Shading, BackgroundIsNothing) {
  Scene scene = quarters();
  scene.views[0] = view_from({0, 0, -3});  // looks away
  for (const char* shading : {"eyelight", "normals"}) {
    const Picture p = render(scene, {.width = 35, .height = 3, .shading = shading});
    for (const char* name : {"R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z"})
      for (const float value : p.image.channel(name).floats) EXPECT_EQ(value, 0) << name;
    for (const std::uint32_t prim : p.image.channel("prim").uints) EXPECT_EQ(prim, NO_HIT);
  }
}

TEST(Shading, ASceneWithoutTriangles) {
  Scene scene;
  scene.name = "nothing";
  finish_scene(scene);
  DeviceScene world(std::move(scene), with_validation());
  for (const Method& method : kMethods)
    for (const char* shading : {"eyelight", "normals"}) {
      RenderOptions options{.width = 40, .height = 20, .spp = 2, .shading = shading};
      options.query.method = method.name;
      const Picture p = render(world, world.scene().views[0], options);
      for (const float alpha : p.image.channel("A").floats) EXPECT_EQ(alpha, 0);
      for (const std::uint32_t prim : p.image.channel("prim").uints) EXPECT_EQ(prim, NO_HIT);
    }
}

TEST(Shading, ATinyTriangleHasAUnitNormal) {
  Scene scene;
  scene.name = "tiny";
  scene.triangles = {{{{0, 0, 0}, {1e-11f, 0, 0}, {0, 1e-11f, 0}}}};
  scene.views.push_back(view_from({2e-12, 2e-12, 1e-11}));
  finish_scene(scene);
  const Picture p = render(std::move(scene), {.width = 31, .height = 31});
  EXPECT_EQ(p.prim(15, 15), 0u);
  EXPECT_NEAR(p.at("N.Z", 15, 15), 1, 1e-6);
}

TEST(Shading, ACornerNormalOfZeroFallsBackToTheFace) {
  Scene scene = square_scene();
  scene.normals.assign(2, {glm::vec3(0), glm::vec3(0), glm::vec3(0)});
  finish_scene(scene);
  const Picture p = render(std::move(scene), {.width = 9, .height = 9});
  EXPECT_NEAR(p.at("N.Z", 4, 4), 1, 1e-6);
}

// A kernel has no binding for data that the scene lacks or the shading does not use.
TEST(Shading, CodeAndBindingsOnlyForWhatIsThere) {
  Context gpu({.device = "", .validate = true});
  const auto kernel = [&](const char* shading, bool normals) {
    return shading_source(shading, SceneFeatures{.shading_normals = normals});
  };
  const Kernel flat(gpu, kernel("eyelight", false)), smooth(gpu, kernel("eyelight", true));
  const Kernel colours(gpu, kernel("normals", false));
  EXPECT_FALSE(flat.wants(BIND_NORMALS));
  EXPECT_TRUE(smooth.wants(BIND_NORMALS));
  EXPECT_TRUE(flat.wants(BIND_MATERIALS));
  EXPECT_FALSE(colours.wants(BIND_MATERIALS));
  EXPECT_TRUE(gpu.messages().empty());
}

TEST(Shading, OptionsOutOfRange) {
  DeviceScene world(quarters(), with_validation());
  const View& view = world.scene().views[0];
  for (const RenderOptions& bad : {RenderOptions{.width = 0}, RenderOptions{.height = 0}, RenderOptions{.width = 16385},
                                   RenderOptions{.spp = 0}, RenderOptions{.spp = 65537}, RenderOptions{.shading = "x"}})
    try {
      world.render(view, bad);
      ADD_FAILURE() << "expected an error, none was thrown";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), Failure::Arguments) << error.what();
    }
}

}  // namespace
}  // namespace ballot::test
