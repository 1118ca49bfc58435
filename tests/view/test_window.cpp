// Tests the real program in a real window, driven by events of the X server.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "tests/images/pictures.h"
#include "tests/view/window_test.h"

namespace ballot::test {
namespace {

void expect_same_pixels(const Image& a, const Image& b) {
  ASSERT_EQ(a.width, b.width);
  ASSERT_EQ(a.height, b.height);
  ASSERT_EQ(a.channels.size(), b.channels.size());
  for (const Channel& channel : a.channels) {
    EXPECT_EQ(channel.floats, b.channel(channel.name).floats) << channel.name;
    EXPECT_EQ(channel.uints, b.channel(channel.name).uints) << channel.name;
  }
}

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

TEST_F(WindowTest, SaysWhatToDoWithoutADisplay) {
  const auto start = std::chrono::steady_clock::now();
  Program program(view("320x240", {}), environment(""));
  EXPECT_EQ(program.wait(), 3) << program.output();
  EXPECT_NE(program.output().find("ballot render"), std::string::npos) << program.output();
  EXPECT_EQ(std::ranges::count(program.output(), '\n'), 1) << program.output();
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(1));
}

TEST_F(WindowTest, FliesAndItsPictureIsTheOneThatRenderMakes) {
  Desktop desktop(800, 600);
  ASSERT_TRUE(desktop.works()) << "is xvfb installed?";
  const fs::path views = folder_ / "views.json";
  Program program(view("480x240", {"--validate", "--spp", "1", "--view", "view0", "--views-file", views.string()}),
                  environment(desktop.name()));
  ASSERT_TRUE(program.says("method " + std::string(kDefaultMethod), 60)) << program.output();
  desktop.move_mouse(400, 120);  // beside the panels
  pause_ms(300);
  const auto before = desktop.pixels(480, 240);
  EXPECT_GT(std::set<unsigned long>(before.begin(), before.end()).size(), 50u) << "the window shows a picture";

  desktop.press("w");
  pause_ms(400);
  desktop.release("w");
  desktop.drag(3, 400, 120, 30, 0);
  pause_ms(600);  // the camera comes to rest
  desktop.tap("v");
  ASSERT_TRUE(program.says("saved-1 appended")) << program.output();
  desktop.tap("F12");
  ASSERT_TRUE(program.says("wrote ")) << program.output();
  EXPECT_NE(desktop.pixels(480, 240), before);

  const View saved = cli::read_views(views).at(0);
  const View start = load_scene(kScene).views.at(0);
  EXPECT_GT(glm::distance(glm::dvec3(saved.world_from_camera[3]), glm::dvec3(start.world_from_camera[3])), 0.05);
  EXPECT_NEAR(saved.world_from_camera[0].y, 0, 1e-12) << "no roll";
  const double turned = glm::dot(glm::dvec3(saved.world_from_camera[2]), glm::dvec3(start.world_from_camera[2]));
  EXPECT_NEAR(std::acos(turned), 30 * 0.0035, 0.01) << "it looked round";
  const fs::path shot = folder_ / "cornell-shot-1.exr";
  const Image image = rendered(views, "saved-1", "480x240");
  expect_same_pixels(read_exr(shot), image);
  EXPECT_TRUE(fs::exists(folder_ / "cornell-shot-1.png"));

  desktop.tap("Tab");  // the picture alone, above the status line; half floats and pow() may round by 1
  for (int i = 0; i < 50 && difference(desktop.pixels(480, 190), image) > 1; ++i) pause_ms(100);
  EXPECT_LE(difference(desktop.pixels(480, 190), image), 1) << "the screen shows the picture";

  desktop.chord("Control_L", "q");
  EXPECT_EQ(program.wait(), 0) << program.output();
}

TEST_F(WindowTest, SwitchesMethodsResizesAndReloadsShaders) {
  Desktop desktop(800, 600);
  ASSERT_TRUE(desktop.works()) << "is xvfb installed?";
  Program program(view("320x240", {"--validate", "--spp", "1", "--view", "view0"}), environment(desktop.name()));
  ASSERT_TRUE(program.says("method " + std::string(kDefaultMethod), 60)) << program.output();
  desktop.move_mouse(250, 120);

  std::size_t at = 0;
  while (kMethods[at].name != kDefaultMethod) ++at;
  for (std::size_t i = 1; i <= std::size(kMethods); ++i) {
    const Method& next = kMethods[(at + i) % std::size(kMethods)];
    desktop.tap("m");
    if (next.name != kDefaultMethod) {
      ASSERT_TRUE(program.says(fmt::format("method {} ", next.name), 60)) << program.output();
    }
  }
  desktop.tap("n");
  ASSERT_TRUE(program.says("numeric ")) << program.output();
  for (std::size_t i = 1; i <= std::size(kRayKinds); ++i) {
    desktop.tap("k");
    ASSERT_TRUE(program.says(fmt::format("rays {}", kRayKinds[i % std::size(kRayKinds)].name))) << program.output();
    pause_ms(100);
  }
  desktop.tap("x");
  ASSERT_TRUE(program.says("comparing", 60)) << program.output();
  desktop.tap("g");
  ASSERT_TRUE(program.says("shading ", 60)) << program.output();

  for (const auto& [width, height] : {std::pair(401, 303), std::pair(200, 150), std::pair(480, 360)}) {
    desktop.resize_window(width, height);
    ASSERT_TRUE(program.says(fmt::format("size {}x{}", width, height))) << program.output();
  }

  const fs::path shader = folder_ / "shaders/rays/primary.comp";
  const auto bytes = read_file(shader);
  const std::string good(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  write_file(shader, good + "\nthis is no GLSL\n");
  ASSERT_TRUE(program.says("a shader does not compile", 60)) << program.output();
  desktop.resize_window(320, 240);  // the last kernel that compiled is still used
  ASSERT_TRUE(program.says("size 320x240")) << program.output();
  write_file(shader, good);
  ASSERT_TRUE(program.says("shaders reloaded", 60)) << program.output();
  EXPECT_FALSE(program.says("does not compile", 1)) << program.output();

  desktop.tap("Tab");  // the picture alone, above the status line
  auto before = desktop.pixels(320, 200);
  for (int i = 0; i < 50; ++i) {  // until it rests
    pause_ms(300);
    const auto now = desktop.pixels(320, 200);
    if (std::exchange(before, now) == now) break;
  }
  const fs::path display = folder_ / "shaders/lib/shade/display.glsl";
  const auto text = read_file(display);
  std::string other(reinterpret_cast<const char*>(text.data()), text.size());
  const std::string_view plain = "vec4(swap_red ? color.bgr : color, 1.0)";
  ASSERT_NE(other.find(plain), std::string::npos);
  write_file(display, other.replace(other.find(plain), plain.size(), "vec4(1.0 - color, 1.0)"));
  ASSERT_TRUE(program.says("shaders reloaded", 60)) << program.output();
  for (int i = 0; i < 50 && desktop.pixels(320, 200) == before; ++i) pause_ms(100);
  EXPECT_NE(desktop.pixels(320, 200), before) << "the change is visible";

  desktop.chord("Control_L", "q");
  EXPECT_EQ(program.wait(), 0) << program.output();
}

}  // namespace
}  // namespace ballot::test
