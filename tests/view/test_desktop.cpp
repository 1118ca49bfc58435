// Tests of what a desktop does to the window (full screen, dense screens, minimising, dropped files) and of input other
// than flying.
#include <cmath>

#include "tests/view/window_test.h"

namespace ballot::test {
namespace {

void quit(Desktop& desktop, Program& program) {
  desktop.chord("Control_L", "q");
  EXPECT_EQ(program.wait(), 0) << program.output();
}

TEST_F(WindowTest, GoesFullScreenAndBack) {
  Desktop desktop(800, 600);
  ASSERT_TRUE(desktop.works()) << "is xvfb installed?";
  Program program(view("320x240", {"--validate", "--spp", "1"}), environment(desktop.name()));
  ASSERT_TRUE(program.says("size 320x240", 60)) << program.output();
  desktop.move_mouse(100, 100);
  for (int i = 0; i < 2; ++i) {
    desktop.tap("F11");
    ASSERT_TRUE(program.says("size 800x600")) << program.output();
    desktop.tap("F11");
    ASSERT_TRUE(program.says("size 320x240")) << program.output();
  }
  quit(desktop, program);
}

TEST_F(WindowTest, IsAsLargeToTheEyeOnADenseScreen) {
  Desktop desktop(800, 600);
  ASSERT_TRUE(desktop.works()) << "is xvfb installed?";
  desktop.set_scale(2);
  Program program(view("320x240", {"--validate", "--spp", "1"}), environment(desktop.name()));
  ASSERT_TRUE(program.says("size 640x480", 60)) << program.output();
  desktop.move_mouse(100, 100);
  quit(desktop, program);
}

TEST_F(WindowTest, WorksNotWhileItIsMinimised) {
  Desktop desktop(800, 600);
  ASSERT_TRUE(desktop.works()) << "is xvfb installed?";
  Program program(view("320x240", {"--validate", "--spp", "65536"}), environment(desktop.name()));
  ASSERT_TRUE(program.says("method ", 60)) << program.output();
  desktop.move_mouse(100, 100);
  const auto busy = [&] {
    const double before = program.cpu_seconds();
    pause_ms(1000);
    return program.cpu_seconds() - before;
  };
  const double refining = busy();
  desktop.minimise();
  pause_ms(300);
  EXPECT_LT(busy(), 0.25 * refining);
  desktop.restore();
  pause_ms(300);
  EXPECT_GT(busy(), 0.5 * refining);
  quit(desktop, program);
}

TEST_F(WindowTest, OpensWhatIsDropped) {
  Desktop desktop(800, 600);
  ASSERT_TRUE(desktop.works()) << "is xvfb installed?";
  write_file(folder_ / "two wedges.obj", std::string_view("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n"));
  write_file(folder_ / "broken.gltf", std::string_view("{"));
  Program program(view("320x240", {"--validate", "--spp", "1"}), environment(desktop.name()));
  ASSERT_TRUE(program.says("method ", 60)) << program.output();
  desktop.move_mouse(100, 100);
  EXPECT_TRUE(desktop.drop(folder_.string() + "/two%20wedges.obj"));
  ASSERT_TRUE(program.says("two wedges: 2 triangles", 60)) << program.output();
  EXPECT_TRUE(desktop.drop(folder_ / "broken.gltf"));
  ASSERT_TRUE(program.says("broken.gltf")) << program.output();
  EXPECT_TRUE(desktop.drop(kScene));
  ASSERT_TRUE(program.says("cornell: 4438 triangles", 60)) << program.output();
  quit(desktop, program);
}

TEST_F(WindowTest, ComesBackToWhereItWas) {
  Desktop desktop(800, 600);
  ASSERT_TRUE(desktop.works()) << "is xvfb installed?";
  const fs::path scene = folder_ / "room.gltf", views = folder_ / "views.json";
  fs::copy_file(kScene, scene);
  for (const char* name : {"saved-1", "saved-2"}) {
    Program program(view("320x240", {"--spp", "1", "--views-file", views.string()}, scene.string()),
                    environment(desktop.name()));
    ASSERT_TRUE(program.says("method ", 60)) << program.output();
    desktop.move_mouse(100, 100);
    if (name == std::string("saved-1")) {
      desktop.press("w");
      pause_ms(400);
      desktop.release("w");
      pause_ms(700);
    }
    desktop.tap("v");
    ASSERT_TRUE(program.says(fmt::format("{} appended", name))) << program.output();
    quit(desktop, program);
  }
  const auto saved = cli::read_views(views);
  const glm::dvec3 first(saved.at(0).world_from_camera[3]), second(saved.at(1).world_from_camera[3]);
  EXPECT_LT(glm::distance(first, second), 1e-12);
  EXPECT_GT(glm::distance(first, glm::dvec3(load_scene(kScene).views.at(0).world_from_camera[3])), 0.05);
}

/// Returns the direction of a pixel's camera ray in the frame of the camera.
glm::dvec3 direction(const View& view, int x, int y, int width, int height) {
  const double half = std::tan(view.yfov / 2);
  return glm::normalize(
      glm::dvec3((2 * (x + 0.5) / width - 1) * half * width / height, (1 - 2 * (y + 0.5) / height) * half, -1));
}

TEST_F(WindowTest, OrbitsAndInspects) {
  constexpr int kX = 330, kY = 150, kWidth = 480, kHeight = 240;
  Desktop desktop(800, 600);
  ASSERT_TRUE(desktop.works()) << "is xvfb installed?";
  const fs::path views = folder_ / "views.json";
  Program program(view("480x240", {"--validate", "--spp", "1", "--view", "view0", "--views-file", views.string()}),
                  environment(desktop.name()));
  ASSERT_TRUE(program.says("method ", 60)) << program.output();
  desktop.move_mouse(kX, kY);
  desktop.tap("2");
  ASSERT_TRUE(program.says("view view1")) << program.output();
  desktop.tap("9");
  ASSERT_TRUE(program.says("there are 5 views, no view 9")) << program.output();
  desktop.tap("1");
  ASSERT_TRUE(program.says("view view0")) << program.output();

  const Image image = rendered({}, "view0", "480x240");
  const std::size_t at = kY * kWidth + kX;
  const std::uint32_t prim = image.channel("prim").uints[at];
  ASSERT_NE(prim, NO_HIT);
  desktop.button(1, true);
  pause_ms(60);
  desktop.button(1, false);
  EXPECT_TRUE(program.says(fmt::format("pixel {}, {}: prim {}, exact {}", kX, kY, prim, prim))) << program.output();

  desktop.tap("Escape");  // the inspector covers the pixel
  pause_ms(500);
  desktop.drag(1, kX, kY, -40, 10);
  pause_ms(500);
  desktop.tap("v");
  ASSERT_TRUE(program.says("saved-1 appended")) << program.output();
  quit(desktop, program);
  const View start = load_scene(kScene).views.at(0), end = cli::read_views(views).at(0);
  const auto point = [&](const View& view) {
    const glm::dvec3 ahead = direction(start, kX, kY, kWidth, kHeight) * double(image.channel("Z").floats[at]);
    return glm::dvec3(view.world_from_camera * glm::dvec4(ahead, 1));
  };
  EXPECT_LT(glm::distance(point(start), point(end)), 1e-5)
      << "the point where the drag began stays at its place in the picture";
  EXPECT_GT(glm::distance(glm::dvec3(start.world_from_camera[3]), glm::dvec3(end.world_from_camera[3])), 0.2);
}

}  // namespace
}  // namespace ballot::test
