// Tests of pictures of surfaces with coloured vertices.
#include <cmath>

#include "tests/images/pictures.h"

namespace ballot::test {
namespace {

TEST(VertexColors, ColoursOfVerticesTintTheSurface) {
  Scene scene = square_scene();
  scene.materials[0].unlit = true;
  scene.materials[0].base_color = {1, 0.5f, 1};
  const glm::vec4 a(1, 1, 0, 1), b(0, 1, 0, 1), c(0, 1, 1, 1), d(1, 1, 1, 1);  // red falls with x, blue rises with y
  scene.colors = {{a, b, c}, {a, c, d}};
  finish_scene(scene);
  DeviceScene world(std::move(scene), with_validation());
  for (const char* shading : {"eyelight", "whitted", "path"}) {
    const Picture p = render(world, world.scene().views[0], {.width = 64, .height = 64, .shading = shading});
    for (const std::uint32_t at : {16u, 32u, 48u}) {
      // A pixel at x shows the square's point x / 32 - 1 times 3 tan(30 degrees).
      const float half = 3 * std::tan(glm::radians(30.0f)), x = ((float(at) + 0.5f) / 32 - 1) * half;
      if (std::abs(x) > 1) continue;
      const glm::vec3 found = p.color(at, 63 - at);
      EXPECT_NEAR(found.r, (1 - x) / 2, 2e-3) << shading << at;
      EXPECT_NEAR(found.g, 0.5f, 1e-3) << shading << at;
      EXPECT_NEAR(found.b, (1 + x) / 2, 2e-3) << shading << at;
    }
  }
}

TEST(VertexColors, AlphaOfVerticesMasks) {
  Scene scene = square_scene();
  scene.materials[0].alpha_mode = Alpha::Mask;
  const glm::vec4 gone(1, 1, 1, 0), there(1);
  scene.colors = {{gone, gone, gone}, {there, there, there}};
  finish_scene(scene);
  const Picture p = render(std::move(scene), {.width = 32, .height = 32, .shading = "path"});
  EXPECT_EQ(p.prim(20, 20), NO_HIT);  // right of and below the diagonal
  EXPECT_EQ(p.prim(12, 12), 1u);
}

}  // namespace
}  // namespace ballot::test
