// Tests of scenes with more triangles than a texel buffer holds. Shading then reads storage buffers.
#include <cstring>

#include "tests/images/pictures.h"

namespace ballot::test {
namespace {

/// Returns a wavy floor of 2 * 16 * 16 triangles below a lamp, with everything that shading reads by triangle.
Scene floor_scene() {
  constexpr int kSide = 16;
  Scene scene;
  scene.name = "floor";
  scene.materials.push_back({.name = "tiles", .base_texture = {.texture = 0}});
  scene.textures.push_back({.image = 0});
  TextureImage image{.name = "noise", .width = 8, .height = 8};
  for (int i = 0; i < 8 * 8 * 4; ++i) image.rgba.push_back(std::uint8_t(i % 4 == 3 ? 255 : 97 * i % 251));
  scene.images.push_back(std::move(image));
  const auto at = [](int x, int y) {
    return glm::vec3(2.0f * float(x) / kSide - 1, 2.0f * float(y) / kSide - 1, 0.125f * float((x * y) % 3));
  };
  const auto add = [&](const Triangle& t) {
    scene.triangles.push_back(t);
    scene.material_of.push_back(0);
    auto& normals = scene.normals.emplace_back();
    auto& colors = scene.colors.emplace_back();
    auto& uvs = scene.uvs[0].emplace_back();
    for (int c = 0; c < 3; ++c) {
      normals[c] = glm::normalize(glm::vec3(t[c].z, t[c].x, 2));
      colors[c] = glm::vec4(glm::abs(t[c]), 1);
      uvs[c] = glm::vec2(t[c]);
    }
  };
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      add({at(x, y), at(x + 1, y), at(x, y + 1)});
      add({at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)});
    }
  scene.lights.push_back({.position = {0.5f, 0.5f, 2}, .intensity = glm::vec3(3)});
  scene.views.push_back(view_from({0, 0, 3}));
  finish_scene(scene);
  return scene;
}

TEST(StoredTriangles, PicturesAndRaysHaveTheSameBits) {
  DeviceScene wide(floor_scene(), with_validation());
  DeviceSceneOptions narrow = with_validation();
  narrow.context = DeviceScene::open_device(narrow);
  narrow.context->lower_limits(1500, ~0ull);  // 512 triangles have 1536 texels
  DeviceScene stored(floor_scene(), narrow);
  EXPECT_FALSE(wide.features().stored);
  EXPECT_TRUE(stored.features().stored);
  for (const char* shading : {"eyelight", "ao", "path"}) {
    const RenderOptions options{.width = 16, .height = 16, .spp = 2, .shading = shading};
    const Picture expected = render(wide, wide.scene().views[0], options),
                  found = render(stored, stored.scene().views[0], options);
    for (std::size_t c = 0; c < expected.image.channels.size(); ++c) {
      EXPECT_EQ(expected.image.channels[c].floats, found.image.channels[c].floats) << shading << " channel " << c;
      EXPECT_EQ(expected.image.channels[c].uints, found.image.channels[c].uints) << shading << " channel " << c;
    }
  }
  const RayKind& kind = find_ray_kind("reflect");
  const auto expected = wide.make_batch(wide.scene().views[0], kind, 16, 16),
             found = stored.make_batch(stored.scene().views[0], kind, 16, 16);
  ASSERT_EQ(expected->count(), found->count());
  EXPECT_GT(found->count(), 0u);
  EXPECT_EQ(0, std::memcmp(expected->rays().data(), found->rays().data(), found->count() * sizeof(Ray)));
}

}  // namespace
}  // namespace ballot::test
