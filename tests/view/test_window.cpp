// Tests of flying, inspecting and switching in a real window, driven by events of the X server.
#include <algorithm>
#include <cmath>
#include <set>

#include "tests/images/pictures.h"
#include "tests/view/window_test.h"

namespace ballot::test {
namespace {

/// Returns the largest difference of a channel between the screen and the upper rows of a picture, in 8-bit steps.
int difference(const std::vector<unsigned long>& screen, const Image& image) {
  int most = 0;
  for (std::size_t i = 0; i < screen.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      const char* names[] = {"B", "G", "R"};
      most = std::max(most, std::abs(test::srgb(image.channel(names[c]).floats[i]) - int(screen[i] >> (8 * c) & 255)));
    }
  return most;
}

glm::dvec3 place_of(const View& view) { return glm::dvec3(view.world_from_camera[3]); }

TEST_F(WindowTest, FliesAndItsPictureIsTheOneThatRenderMakes) {
  start(options(), 480, 240);
  const auto before = desktop_.pixels(480, 240);
  EXPECT_GT(std::set<unsigned long>(before.begin(), before.end()).size(), 50u) << "the window shows a picture";

  fly();
  drag(3, 400, 120, 30, 0);
  EXPECT_NE(desktop_.pixels(480, 240), before);
  tap("v", "saved-1 appended");

  const View saved = cli::read_views(folder_ / "views.json").at(0), begin = load_scene(kScene).views.at(0);
  EXPECT_GT(glm::distance(place_of(saved), place_of(begin)), 0.05);
  EXPECT_NEAR(saved.world_from_camera[0].y, 0, 1e-12) << "no roll";
  const double turned = glm::dot(glm::dvec3(saved.world_from_camera[2]), glm::dvec3(begin.world_from_camera[2]));
  EXPECT_NEAR(std::acos(turned), 30 * 0.0035, 0.01) << "it looked round";
  const Image image = rendered(saved);
  expect_same_pixels(shot(), image);
  EXPECT_TRUE(fs::exists(folder_ / "cornell-shot-1.png"));

  desktop_.tap("Tab");  // the picture alone, above the status line; half floats and pow() may round by 1
  EXPECT_TRUE(until([&] { return difference(desktop_.pixels(480, 190), image) <= 1; })) << "the screen shows it";
}

/// Returns the direction of a pixel's camera ray in the frame of the camera.
glm::dvec3 direction(const View& view, int x, int y, int width, int height) {
  const double half = std::tan(view.yfov / 2);
  return glm::normalize(
      glm::dvec3((2 * (x + 0.5) / width - 1) * half * width / height, (1 - 2 * (y + 0.5) / height) * half, -1));
}

TEST_F(WindowTest, OrbitsAndInspects) {
  constexpr int kX = 330, kY = 150, kWidth = 480, kHeight = 240;
  start(options(), kWidth, kHeight);
  desktop_.move_mouse(kX, kY);
  tap("2", "view view1");
  tap("9", "there are 5 views, no view 9");
  tap("1", "view view0");
  rest();

  const View begin = load_scene(kScene).views.at(0);
  const Image image = rendered(begin);
  const std::size_t at = kY * kWidth + kX;
  const std::uint32_t prim = image.channel("prim").uints[at];
  ASSERT_NE(prim, NO_HIT);
  desktop_.button(1, true);
  until([&] { return session_->window().input().buttons[0]; });
  desktop_.button(1, false);
  EXPECT_TRUE(says(fmt::format("pixel {}, {}: prim {}, exact {}", kX, kY, prim, prim))) << session_->facts().message;

  desktop_.tap("Escape");  // the inspector covers the pixel
  EXPECT_TRUE(until([&] { return !session_->facts().picked; }));
  rest();
  drag(1, kX, kY, -40, 10);
  tap("v", "saved-1 appended");
  const View end = cli::read_views(folder_ / "views.json").at(0);
  const auto point = [&](const View& view) {
    const glm::dvec3 ahead = direction(begin, kX, kY, kWidth, kHeight) * double(image.channel("Z").floats[at]);
    return glm::dvec3(view.world_from_camera * glm::dvec4(ahead, 1));
  };
  EXPECT_LT(glm::distance(point(begin), point(end)), 1e-5)
      << "the point where the drag began stays at its place in the picture";
  EXPECT_GT(glm::distance(place_of(begin), place_of(end)), 0.2);
}

TEST_F(WindowTest, SwitchesAndCounts) {
  view::SessionOptions o = options();
  o.settings.query.method = kDefaultMethod;
  start(o);
  const auto switches = [&](const char* key, const std::string& setting, std::string_view to) {
    desktop_.tap(key);
    EXPECT_TRUE(until([&] { return setting == to; })) << key << ": " << setting;
    rest();
  };
  view::Settings& s = session_->settings();
  std::size_t at = 0;
  while (kMethods[at].name != kDefaultMethod) ++at;
  for (std::size_t i = 1; i <= std::size(kMethods); ++i) {
    const std::string name(kMethods[(at + i) % std::size(kMethods)].name);
    switches("m", s.query.method, name);
    if (i < std::size(kMethods)) {  // the first method's kernels were compiled before
      EXPECT_EQ(session_->facts().message, "method " + name + " watertight");
    }
  }
  for (std::size_t i = 1; i <= std::size(kRayKinds); ++i)
    switches("k", s.rays, kRayKinds[i % std::size(kRayKinds)].name);
  tap("c", "nodes per ray");
  for (std::size_t i = 1; i <= std::size(view::shadings()); ++i)
    switches("g", s.shading, view::shadings()[i % std::size(view::shadings())].name);
  switches("n", s.query.numeric, "exact");
}

TEST_F(WindowTest, ReloadsShadersAndKeepsTheLastGoodOne) {
  const fs::path shaders = folder_ / "shaders";
  fs::copy(fs::path(BALLOT_SOURCE_DIR) / "shaders", shaders, fs::copy_options::recursive);
  setenv("BALLOT_SHADERS", shaders.c_str(), 1);
  start(options());
  const auto text_of = [](const fs::path& file) {
    const auto bytes = read_file(file);
    return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  };
  const fs::path shader = shaders / "rays/primary.comp";
  const std::string good = text_of(shader);
  write_file(shader, good + "\nthis is no GLSL\n");
  ASSERT_TRUE(says("a shader does not compile"));
  EXPECT_NE(session_->facts().shader_error.find("primary.comp"), std::string::npos) << session_->facts().shader_error;
  desktop_.resize_window(300, 200);  // the last kernel that compiled is still used
  ASSERT_TRUE(says("size 300x200"));
  rest();
  write_file(shader, good);
  EXPECT_TRUE(until([&] { return session_->facts().shader_error.empty(); }));
  rest();
  EXPECT_EQ(session_->facts().shader_error, "");

  desktop_.tap("Tab");  // the picture alone, above the status line
  EXPECT_TRUE(until([&] { return !session_->settings().panels; }));
  rest();
  const auto before = desktop_.pixels(300, 160);
  const fs::path display = shaders / "lib/shade/display.glsl";
  std::string other = text_of(display);
  const std::string_view plain = "vec4(color.bgr, 1.0)";
  ASSERT_NE(other.find(plain), std::string::npos);
  write_file(display, other.replace(other.find(plain), plain.size(), "vec4(1.0 - color, 1.0)"));
  EXPECT_TRUE(until([&] { return desktop_.pixels(300, 160) != before; })) << "the change is visible";
}

}  // namespace
}  // namespace ballot::test
