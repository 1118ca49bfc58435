// Tests that the viewer plays animations and refines paths, in a real window.
#include "tests/view/window_test.h"

namespace ballot::test {
namespace {

// A picture at a chosen time is the one that render() makes; key P plays from there, and pauses.
TEST_F(WindowTest, ScrubsPlaysAndPauses) {
  start(options(kScenes + "dance.gltf"));
  session_->settings().play.seconds = 1.25;
  session_->frame();
  rest();
  const Image at = shot();
  expect_same_pixels(at, rendered(session_->world().scene_facts().views.at(0), {}, 1.25));
  tap("p", "playing dance at 1.250 s");
  EXPECT_TRUE(until([&] { return session_->settings().play.seconds > 1.4; }));
  EXPECT_GT(session_->facts().frames.back().pose, 0);
  EXPECT_GT(session_->facts().frames.back().tree, 0);
  tap("p", "paused dance at ");
  rest();
  EXPECT_NE(shot().channel("Z").floats, at.channel("Z").floats);
}

// The same for meshes that are kept once and move as instances.
TEST_F(WindowTest, ScrubsInstances) {
  load_.instances = InstancePolicy::Keep;
  start(options(kScenes + "meadow.gltf"), 160, 120);
  session_->settings().play.seconds = 0.3;
  session_->frame();
  rest();
  expect_same_pixels(shot(), rendered(session_->world().scene_facts().views.at(0), {}, 0.3));
}

TEST_F(WindowTest, SaysThatAStillSceneHasNoAnimation) {
  start(options());
  tap("p", "the scene has no animation");
}

// A window shows paths, refines them at rest also after a move, and writes the picture that render() makes.
TEST_F(WindowTest, RefinesPaths) {
  view::SessionOptions o = options();
  o.settings.shading = "path";
  o.settings.samples = 3;
  start(o, 200, 160);
  EXPECT_EQ(session_->facts().samples, 3u);
  drag(3, 180, 80, 5, 5);
  EXPECT_EQ(session_->facts().samples, 3u);
  desktop_.tap("g");
  EXPECT_TRUE(until([&] { return session_->settings().shading != "path"; }));
  rest();
  session_->settings().shading = "path";
  tap("1", "view view0");
  rest();
  const Integrator& path = *find_integrator("path");
  const View start_view = load_scene(kScene).views.at(0);
  expect_same_pixels(shot(), rendered(start_view, {.spp = 3, .shading = "path", .clamp = path.clamp}));
}

}  // namespace
}  // namespace ballot::test
