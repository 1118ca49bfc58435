// Tests of what a desktop does to the window (full screen, dense screens, sizes, minimising, dropped files), and of the
// program as a whole.
#include <cstdio>

#include "tests/view/window_test.h"

namespace ballot::test {
namespace {

using Size = glm::uvec2;

TEST_F(WindowTest, TakesTheSizesThatItIsGiven) {
  start(options());
  const auto becomes = [&](Size size) { return until([&] { return session_->window().pixels() == size; }); };
  for (const Size size : {Size(401, 303), Size(200, 150), Size(320, 240)}) {
    desktop_.resize_window(int(size.x), int(size.y));
    EXPECT_TRUE(becomes(size)) << size.x;
    rest();
    EXPECT_EQ(Size(session_->facts().width, session_->facts().height), size);
  }
  for (int i = 0; i < 2; ++i) {
    desktop_.tap("F11");
    EXPECT_TRUE(becomes({800, 600}));
    rest();
    desktop_.tap("F11");
    EXPECT_TRUE(becomes({320, 240}));
    rest();
  }
}

TEST_F(WindowTest, IsAsLargeToTheEyeOnADenseScreen) {
  desktop_.set_scale(2);
  start(options());
  EXPECT_EQ(session_->window().pixels(), Size(640, 480));
}

TEST_F(WindowTest, WorksNotWhileItIsMinimised) {
  start(options());
  session_->settings().samples = 65536;
  const auto more = [&] {
    return until([&, had = session_->facts().samples] { return session_->facts().samples > had; });
  };
  EXPECT_TRUE(more());
  desktop_.minimise(true);
  EXPECT_TRUE(until([&] { return session_->window().minimised(); }));
  const std::uint32_t samples = session_->facts().samples;
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 3; ++i) session_->frame();
  EXPECT_EQ(session_->facts().samples, samples);
  EXPECT_GT(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(250)) << "it waits for events";
  desktop_.minimise(false);
  EXPECT_TRUE(more());
}

TEST_F(WindowTest, OpensWhatIsDropped) {
  write_file(folder_ / "two wedges.obj", std::string_view("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n"));
  write_file(folder_ / "broken.gltf", std::string_view("{"));
  start(options());
  const auto drop = [&](const std::string& file, const std::string& answer) {
    EXPECT_TRUE(desktop_.drop(file, [&] { session_->frame(); })) << file;
    EXPECT_TRUE(says(answer)) << session_->facts().message;
    rest();
  };
  drop(folder_.string() + "/two%20wedges.obj", "method ");
  EXPECT_EQ(session_->world().triangle_count(), 2u);
  drop(folder_ / "broken.gltf", "broken.gltf");
  EXPECT_EQ(session_->world().triangle_count(), 2u);
  drop(kScene, "method ");
  EXPECT_EQ(session_->world().scene().name, "cornell");
}

TEST_F(WindowTest, ComesBackToWhereItWas) {
  fs::copy_file(kScene, folder_ / "room.gltf");
  view::SessionOptions o = options(folder_ / "room.gltf");
  o.view.clear();
  start(o);
  fly();
  tap("v", "saved-1 appended");
  quit();
  start(o);
  tap("v", "saved-2 appended");
  const auto saved = cli::read_views(folder_ / "views.json");
  const View begin = load_scene(kScene).views.at(0);
  for (int c = 0; c < 4; ++c)
    EXPECT_LT(glm::distance(saved.at(0).world_from_camera[c], saved.at(1).world_from_camera[c]), 1e-12);
  EXPECT_GT(glm::distance(saved.at(0).world_from_camera[3], begin.world_from_camera[3]), 0.05);
}

/// Runs `ballot view` with more words, and returns its exit code and what it prints.
std::pair<int, std::string> view_ends(const std::string& words) {
  std::FILE* pipe =
      popen((std::string(BALLOT_BINARY) + " view " + kScene + " --device cpu " + words + " 2>&1").c_str(), "r");
  std::string said;
  for (int c; (c = std::fgetc(pipe)) != EOF;) said += char(c);
  const int status = pclose(pipe);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, said};
}

TEST_F(WindowTest, TheProgramTurnsForSoManyFrames) {
  const auto [code, said] = view_ends("--size 320x240 --validate --frames 5");
  EXPECT_EQ(code, 0) << said;
  EXPECT_NE(said.find("5 frames, "), std::string::npos) << said;
  EXPECT_NE(said.find("trace "), std::string::npos) << said;
}

TEST_F(WindowTest, TheProgramSaysWhatToDoWithoutADisplay) {
  unsetenv("DISPLAY");
  const auto begin = std::chrono::steady_clock::now();
  const auto [code, said] = view_ends("");
  EXPECT_EQ(code, 3) << said;
  EXPECT_NE(said.find("ballot render"), std::string::npos) << said;
  EXPECT_EQ(std::ranges::count(said, '\n'), 1) << said;
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(1));
}

}  // namespace
}  // namespace ballot::test
