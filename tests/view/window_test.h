// A fixture that runs a session of the viewer in a window on its own display, and acts as its user.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>

#include "tests/temporary.h"
#include "tests/view/desktop.h"
#include "tools/program/views_file.h"
#include "tools/view/session.h"

namespace ballot::test {

namespace fs = std::filesystem;

inline const std::string kScenes = std::string(BALLOT_SOURCE_DIR) + "/scenes/";
inline const std::string kScene = kScenes + "cornell.gltf";

class WindowTest : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(desktop_.works()) << "is xvfb installed?"; }
  void TearDown() override {
    if (session_) quit();
    unsetenv("BALLOT_SHADERS");
  }

  /// Returns options of a session: one sample a pixel, from the scene's first view, by a method that is one kernel.
  view::SessionOptions options(const std::string& scene = kScene) const {
    view::SessionOptions o;
    o.scene = scene;
    o.load = load_;
    o.world = {.device = "cpu", .validate = true};
    o.settings.samples = 1;
    o.settings.query.method = "while-while";
    o.view = "view0";
    o.views_file = (folder_ / "views.json").string();
    o.out = folder_.string();
    return o;
  }

  /// Opens a window of this size and shows frames until the picture is finished.
  void start(view::SessionOptions o, std::uint32_t width = 320, std::uint32_t height = 240) {
    o.width = width, o.height = height;
    session_ = std::make_unique<view::Session>(std::move(o));
    desktop_.move_mouse(int(width) - 20, int(height) / 2);  // beside the panels
    rest();
  }
  /// Closes the window by its key, and expects that the validation layers reported nothing.
  void quit() {
    desktop_.key("Control_L", true);
    desktop_.tap("q");
    EXPECT_TRUE(until([&] { return session_->window().closed(); }));
    desktop_.key("Control_L", false);
    EXPECT_EQ(session_->run(), 0u) << session_->world().messages().front();
    session_.reset();
  }

  /// Shows frames until `done()` holds. Returns false if it does not within a minute.
  template <class Done>
  bool until(const Done& done) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
    while (!done() && std::chrono::steady_clock::now() < end) session_->frame();
    return done();
  }
  void rest() {
    session_->frame();
    EXPECT_TRUE(until([&] { return session_->facts().resting; })) << session_->facts().message;
  }
  /// Shows frames until the last message contains the text.
  bool says(const std::string& text) {
    return until([&] { return session_->facts().message.find(text) != std::string::npos; });
  }
  void tap(const char* key, const std::string& answer) {
    desktop_.tap(key);
    EXPECT_TRUE(says(answer)) << key << ": " << session_->facts().message;
  }
  /// Flies forward for a moment, and waits until the camera rests.
  void fly() {
    desktop_.key("w", true);
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(300);
    until([&] { return std::chrono::steady_clock::now() > end; });
    desktop_.key("w", false);
    until([&] { return !session_->window().input().down[GLFW_KEY_W]; });
    rest();
  }
  /// Drags the mouse from (x, y) to (x + dx, y + dy) with a button held down, and waits until the camera rests.
  void drag(int button, int x, int y, int dx, int dy) {
    desktop_.move_mouse(x, y);
    session_->frame();
    desktop_.button(button, true);
    until([&] { return session_->window().input().buttons[button == 1 ? 0 : 1]; });
    for (int step = 1; step <= 10; ++step) {
      desktop_.move_mouse(x + dx * step / 10, y + dy * step / 10);
      session_->frame();
    }
    until([&] { return session_->window().input().mouse == glm::dvec2(x + dx, y + dy); });
    desktop_.button(button, false);
    until([&] { return !session_->window().input().buttons[button == 1 ? 0 : 1]; });
    rest();
  }
  /// Returns the EXR of a view, of the window's size, that an engine of its own makes.
  Image rendered(const View& view, RenderOptions o = {}, double time = 0) const {
    const view::SessionOptions of = options(session_->facts().scene_file);
    DeviceScene world(load_scene(of.scene, load_), of.world);
    if (time > 0) world.set_time(0, time);
    o.width = session_->window().pixels().x, o.height = session_->window().pixels().y;
    write_exr(folder_ / "rendered.exr", world.render(view, o));
    return read_exr(folder_ / "rendered.exr");
  }
  /// Writes a picture by key F12, and returns it.
  Image shot() {
    static const std::string kWrote = "wrote ";
    tap("F12", kWrote);
    const std::string message = session_->facts().message;
    return read_exr(message.substr(kWrote.size(), message.find(".exr") + 4 - kWrote.size()));
  }

  const TemporaryFolder kept_;
  const fs::path folder_ = kept_.path();
  Desktop desktop_{800, 600};
  LoadOptions load_;
  std::unique_ptr<view::Session> session_;
};

inline void expect_same_pixels(const Image& a, const Image& b) {
  ASSERT_EQ(a.width, b.width);
  ASSERT_EQ(a.height, b.height);
  ASSERT_EQ(a.channels.size(), b.channels.size());
  for (const Channel& channel : a.channels) {
    EXPECT_EQ(channel.floats, b.channel(channel.name).floats) << channel.name;
    EXPECT_EQ(channel.uints, b.channel(channel.name).uints) << channel.name;
  }
}

}  // namespace ballot::test
