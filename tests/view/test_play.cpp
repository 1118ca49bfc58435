// Tests that the viewer plays animations, in a real window.
#include <gtest/gtest.h>

#include <fstream>

#include "tests/view/window_test.h"

namespace ballot::test {
namespace {

const std::string kDance = std::string(BALLOT_SOURCE_DIR) + "/scenes/dance.gltf";

class PlayTest : public WindowTest {
 protected:
  std::string script(const std::string& text) const {
    std::ofstream(folder_ / "play.txt") << text;
    return (folder_ / "play.txt").string();
  }
};

// A picture at a chosen time is the one that `render --time` makes; key P plays from there, and pauses.
TEST_F(PlayTest, ScrubsPlaysAndPauses) {
  Desktop desktop(800, 600);
  ASSERT_TRUE(desktop.works()) << "is xvfb installed?";
  const fs::path shot = folder_ / "at.exr", later = folder_ / "later.exr", exr = folder_ / "rendered.exr";
  Program program(view("320x240",
                       {"--validate", "--spp", "1", "--view", "view0", "--script",
                        script("wait 2\ntime 1.25\nwait 2\nshot " + shot.string() +
                               "\nkey P\nwait 1s\nkey P\nwait 2\nshot later.exr\ntimes\nquit\n")},
                       kDance),
                  environment(desktop.name()));
  EXPECT_EQ(program.wait(90), 0) << program.output();
  for (const char* words : {"playing dance at 1.250 s", "paused dance at ", "pose "})
    EXPECT_NE(program.output().find(words), std::string::npos) << words << "\n" << program.output();
  Program render({BALLOT_BINARY, "render", kDance, "--device", "cpu", "--view", "view0", "--size", "320x240",
                  "--animation", "dance", "--time", "1.25", "--out", exr.string()},
                 environment(""));
  ASSERT_EQ(render.wait(60), 0) << render.output();
  const Image here = read_exr(shot), there = read_exr(exr);
  for (const Channel& channel : there.channels) {
    EXPECT_EQ(channel.floats, here.channel(channel.name).floats) << channel.name;
    EXPECT_EQ(channel.uints, here.channel(channel.name).uints) << channel.name;
  }
  EXPECT_NE(read_exr(later).channel("Z").floats, here.channel("Z").floats);
}

// A script may ask for a picture before the first frame: the window's size is known by then.
TEST_F(PlayTest, ShootsAtOnce) {
  Desktop desktop(800, 600);
  ASSERT_TRUE(desktop.works()) << "is xvfb installed?";
  const fs::path shot = folder_ / "first.exr";
  Program program(view("200x160", {"--view", "view0", "--script", script("shot " + shot.string() + "\nquit\n")}),
                  environment(desktop.name()));
  EXPECT_EQ(program.wait(60), 0) << program.output();
  EXPECT_EQ(read_exr(shot).width, 200u);
}

// A window shows paths, refines them at rest also after a move, and writes the picture that `render` makes.
TEST_F(PlayTest, RefinesPaths) {
  Desktop desktop(800, 600);
  ASSERT_TRUE(desktop.works()) << "is xvfb installed?";
  const fs::path shot = folder_ / "paths.exr", exr = folder_ / "rendered.exr";
  Program program(view("200x160", {"--validate", "--spp", "3", "--view", "view0", "--shading", "path", "--script",
                                   script("wait refined\nmouse 5 5\nwait refined\nkey G\nwait 2\nshading path\n"
                                          "view view0\nwait refined\nshot " +
                                          shot.string() + "\nquit\n")}),
                  environment(desktop.name()));
  EXPECT_EQ(program.wait(90), 0) << program.output();
  Program render({BALLOT_BINARY, "render", kScene, "--device", "cpu", "--view", "view0", "--size", "200x160",
                  "--shading", "path", "--spp", "3", "--out", exr.string()},
                 environment(""));
  ASSERT_EQ(render.wait(60), 0) << render.output();
  EXPECT_EQ(read_exr(shot).channel("R").floats, read_exr(exr).channel("R").floats);
}

// The same for meshes that are kept once and move as instances.
TEST_F(PlayTest, ScrubsInstances) {
  const std::string meadow = std::string(BALLOT_SOURCE_DIR) + "/scenes/meadow.gltf";
  Desktop desktop(800, 600);
  ASSERT_TRUE(desktop.works()) << "is xvfb installed?";
  const fs::path shot = folder_ / "at.exr", exr = folder_ / "rendered.exr";
  Program program(view("160x120",
                       {"--validate", "--spp", "1", "--view", "view0", "--instances", "keep", "--script",
                        script("wait 2\ntime 0.3\nwait 2\nshot " + shot.string() + "\nquit\n")},
                       meadow),
                  environment(desktop.name()));
  EXPECT_EQ(program.wait(90), 0) << program.output();
  Program render({BALLOT_BINARY, "render", meadow, "--device", "cpu", "--view", "view0", "--size", "160x120",
                  "--instances", "keep", "--time", "0.3", "--out", exr.string()},
                 environment(""));
  ASSERT_EQ(render.wait(60), 0) << render.output();
  EXPECT_EQ(read_exr(exr).channel("prim").uints, read_exr(shot).channel("prim").uints);
  EXPECT_EQ(read_exr(exr).channel("Z").floats, read_exr(shot).channel("Z").floats);
}

TEST_F(PlayTest, SaysThatAStillSceneHasNoAnimation) {
  Desktop desktop(800, 600);
  ASSERT_TRUE(desktop.works()) << "is xvfb installed?";
  Program program(view("320x240", {"--spp", "1", "--script", script("wait 2\nkey P\nwait 2\nquit\n")}),
                  environment(desktop.name()));
  EXPECT_EQ(program.wait(90), 0) << program.output();
  EXPECT_NE(program.output().find("the scene has no animation"), std::string::npos) << program.output();
}

}  // namespace
}  // namespace ballot::test
