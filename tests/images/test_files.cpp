// Tests of the EXR files: their attributes, their matrices in OpenEXR's conventions, and that other programs read them.
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "tests/cpu/needs.h"
#include "tests/images/pictures.h"
#include "tests/temporary.h"

namespace ballot::test {
namespace {

/// Multiplies a point, as a row vector, by the matrix of an attribute and divides by w, as OpenEXR's V3f * M44f does.
glm::dvec3 transformed(const Image& image, const char* attribute, const glm::dvec3& point) {
  const auto m = std::get<std::array<float, 16>>(image.attributes.at(attribute));
  const double in[4] = {point.x, point.y, point.z, 1};
  double out[4] = {};
  for (std::size_t c = 0; c < 4; ++c)
    for (std::size_t r = 0; r < 4; ++r) out[c] += in[r] * double(m[r * 4 + c]);
  return glm::dvec3(out[0], out[1], out[2]) / out[3];
}

/// Returns the square, seen by a camera that is moved and turned.
Scene posed_scene() {
  Scene scene = square_scene();
  const glm::dmat4 turn = glm::rotate(glm::dmat4(1), 0.3, glm::normalize(glm::dvec3(1, 2, 0.5)));
  scene.views[0] = view_from({0.8, -0.2, 2.5}, turn);
  return scene;
}

/// Returns origin and unit direction, in the world, of the camera ray through the middle of a pixel.
std::pair<glm::dvec3, glm::dvec3> eye_ray(const View& view, std::uint32_t x, std::uint32_t y, const Image& image) {
  const glm::dvec2 at = plane_point(view, x + 0.5, y + 0.5, image.width, image.height);
  const glm::dmat4& m = view.world_from_camera;
  const glm::dvec4 from = view.orthographic ? glm::dvec4(at, 0, 1) : glm::dvec4(0, 0, 0, 1);
  const glm::dvec4 dir = view.orthographic ? glm::dvec4(0, 0, -1, 0) : glm::dvec4(at, -1, 0);
  return {glm::dvec3(m * from), glm::normalize(glm::dvec3(m * dir))};
}

TEST(Files, EveryAttribute) {
  DeviceScene world(square_scene(), with_validation());
  RenderOptions options{.width = 8, .height = 8, .spp = 3};
  options.query.method = "packet";
  options.query.knobs = {{"vote", "any"}};
  const Picture p = render(world, world.scene().views[0], options);
  const auto& all = p.image.attributes;
  EXPECT_EQ(std::get<std::string>(all.at("scene")), "square");
  EXPECT_EQ(std::get<std::string>(all.at("view")), "test");
  EXPECT_TRUE(std::get<std::string>(all.at("method")).starts_with("packet "));
  EXPECT_NE(std::get<std::string>(all.at("method")).find("vote=any"), std::string::npos);
  EXPECT_EQ(std::get<std::string>(all.at("numeric")), "watertight");
  EXPECT_EQ(std::get<std::string>(all.at("device")), world.device().name);
  EXPECT_EQ(std::get<std::string>(all.at("driver")), world.device().driver);
  EXPECT_EQ(std::get<int>(all.at("subgroup_size")), int(world.device().subgroup_size));
  EXPECT_EQ(std::get<int>(all.at("spp")), 3);
  EXPECT_GT(std::get<float>(all.at("seconds")), 0);
  EXPECT_FALSE(std::get<std::string>(all.at("commit")).empty());
  for (const char* name : {"worldToCamera", "worldToNDC"})
    EXPECT_TRUE((std::holds_alternative<std::array<float, 16>>(all.at(name)))) << name;
}

TEST(Files, WorldToCameraMapsTheEyeToTheOrigin) {
  const Scene scene = posed_scene();
  const View view = scene.views[0];
  const Picture p = render(scene, {.width = 32, .height = 16});
  const glm::dmat4& m = view.world_from_camera;
  EXPECT_LT(glm::length(transformed(p.image, "worldToCamera", glm::dvec3(m[3]))), 1e-5);
  EXPECT_LT(glm::length(transformed(p.image, "worldToCamera", glm::dvec3(m[3] + 2.0 * m[0])) - glm::dvec3(2, 0, 0)),
            1e-5);
  EXPECT_LT(glm::length(transformed(p.image, "worldToCamera", glm::dvec3(m[3] + 2.0 * m[1])) - glm::dvec3(0, 2, 0)),
            1e-5);
}

// OpenEXR's ImfStandardAttributes.h: camera space is left-handed, "objects in front of the camera have positive z
// coordinates".
TEST(Files, WorldToCameraLooksAlongPositiveZ) {
  const Scene scene = posed_scene();
  const glm::dmat4 m = scene.views[0].world_from_camera;
  const Picture p = render(scene, {.width = 32, .height = 16});
  EXPECT_LT(glm::length(transformed(p.image, "worldToCamera", glm::dvec3(m[3] - 2.0 * m[2])) - glm::dvec3(0, 0, 2)),
            1e-5);
}

// ImfStandardAttributes.h: x points right and y down; "(0, 0) and (1, 1) correspond to the upper left and lower right
// corners of the OpenEXR display window".
TEST(Files, WorldToNdcMapsWhatAPixelSeesToThePixel) {
  for (const bool orthographic : {false, true}) {
    SCOPED_TRACE(orthographic ? "orthographic" : "perspective");
    Scene scene = posed_scene();
    scene.views[0].orthographic = orthographic;
    const View view = scene.views[0];
    const Picture p = render(std::move(scene), {.width = 32, .height = 16});
    std::size_t wrong = 0, seen = 0;
    for (std::uint32_t y = 0; y < 16; ++y)
      for (std::uint32_t x = 0; x < 32; ++x) {
        if (p.prim(x, y) == NO_HIT) continue;
        const auto [from, dir] = eye_ray(view, x, y, p.image);
        const glm::dvec3 ndc = transformed(p.image, "worldToNDC", from + dir * double(p.at("Z", x, y)));
        ++seen;
        wrong += std::abs(ndc.x - (x + 0.5) / 32) > 1e-5 || std::abs(ndc.y - (y + 0.5) / 16) > 1e-5;
      }
    EXPECT_GT(seen, 20u);
    EXPECT_EQ(wrong, 0u) << "of " << seen;
  }
}

TEST(Files, ExrThereAndBack) {
  const TemporaryFolder folder;
  const Picture p = render(square_scene(), {.width = 33, .height = 7, .spp = 2});
  write_exr(folder.path() / "p.exr", p.image);
  const Image back = read_exr(folder.path() / "p.exr");
  EXPECT_EQ(back.width, 33u);
  EXPECT_EQ(back.height, 7u);
  EXPECT_EQ(back.attributes, p.image.attributes);
  EXPECT_EQ(back.channels.size(), p.image.channels.size());
  for (const Channel& c : p.image.channels) {
    const Channel& read = back.channel(c.name);
    EXPECT_EQ(read.type, c.type) << c.name;
    EXPECT_EQ(read.uints, c.uints) << c.name;
    const double error = c.type == Pixel::Half ? 5e-4 : 0;  // absolute, for values up to 1
    ASSERT_EQ(read.floats.size(), c.floats.size()) << c.name;
    for (std::size_t i = 0; i < c.floats.size(); ++i) EXPECT_NEAR(read.floats[i], c.floats[i], error) << c.name;
  }
}

TEST(Files, ExrheaderReadsIt) {
  BALLOT_NEEDS(std::system("exrheader -h > /dev/null 2>&1") != 127 << 8, "exrheader is not installed (package openexr)")
  const TemporaryFolder folder;
  const Picture p = render(square_scene(), {.width = 33, .height = 7});
  write_exr(folder.path() / "p.exr", p.image);
  const std::string command = "exrheader '" + (folder.path() / "p.exr").string() + "' 2>&1";
  std::FILE* pipe = ::popen(command.c_str(), "r");
  ASSERT_TRUE(pipe);
  std::string text;
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) text.push_back(char(c));
  EXPECT_EQ(::pclose(pipe), 0) << text;
  for (const char* part : {"zip", "R, 16-bit floating-point", "A, 16-bit floating-point", "Z, 32-bit floating-point",
                           "N.X, 32-bit floating-point", "prim, 32-bit unsigned integer", "(0 0) - (32 6)",
                           "scene (type string): \"square\"", "numeric (type string): \"watertight\"",
                           "spp (type int): 1", "worldToNDC (type m44f)", "worldToCamera (type m44f)"})
    EXPECT_NE(text.find(part), std::string::npos) << part << " is not in\n" << text;
}

}  // namespace
}  // namespace ballot::test
