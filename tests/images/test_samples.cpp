// Tests of the samples of a pixel: how they are spread, and how bright ones are clamped.
#include <cmath>

#include "tests/images/pictures.h"

namespace ballot::test {
namespace {

TEST(Samples, ClampScalesBrightSamplesDown) {
  Scene scene = square_scene();
  scene.sky = make_sky("4,8,2");
  scene.materials[0].base_color = {1, 1, 1};
  finish_scene(scene);
  DeviceScene world(std::move(scene), with_validation());
  RenderOptions options{.width = 8, .height = 8, .spp = 4, .shading = "path"};
  const View& view = world.scene().views[0];
  const glm::vec3 free = render(world, view, options).color(0, 0);
  EXPECT_NEAR(free.g, 8, 1e-2);  // the sky itself
  options.clamp = 4;
  const Picture clamped = render(world, view, options);
  EXPECT_NEAR(clamped.color(0, 0).g, 4, 1e-2);
  EXPECT_NEAR(clamped.color(0, 0).r, 2, 1e-2);  // the hue stays
  EXPECT_EQ(std::get<float>(clamped.image.attributes.at("clamp")), 4);
  options.clamp = 100;
  EXPECT_EQ(render(world, view, options).color(0, 0), free);
  options.clamp = -1;
  EXPECT_THROW(world.render(view, options), Error);
}

// Of pixels that an edge crosses, independent samples would miss the covered share p by sqrt(p (1 - p) / n).
TEST(Samples, SamplesOfAPixelAreSpreadEvenly) {
  Scene scene = square_scene();
  scene.materials[0].unlit = true;
  scene.materials[0].base_color = {1, 1, 1};
  for (Triangle& t : scene.triangles)
    for (glm::vec3& v : t) v = glm::vec3(glm::rotate(glm::dmat4(1), 0.3, glm::dvec3(0, 0, 1)) * glm::dvec4(v, 1));
  finish_scene(scene);
  DeviceScene world(std::move(scene), with_validation());
  const View& view = world.scene().views[0];
  const auto shares = [&](std::uint32_t spp) {
    return render(world, view,
                  {.width = 48, .height = 48, .spp = spp, .shading = "path", .aovs = {"color"}, .bounces = 0})
        .image.channel("G")
        .floats;
  };
  const std::vector<float> exact = shares(4096), found = shares(64);
  double errors = 0, independent = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    const double p = exact[i];
    errors += (found[i] - p) * (found[i] - p);
    independent += p * (1 - p) / 64;
  }
  EXPECT_GT(independent, 0.05);  // edges are in sight
  EXPECT_LT(std::sqrt(errors / independent), 0.5);
}

}  // namespace
}  // namespace ballot::test
