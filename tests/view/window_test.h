// Runs the viewer in a window on its own display, and renders the pictures that its output is compared with.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "engine/ballot.h"
#include "tests/view/desktop.h"
#include "tools/program/views_file.h"

namespace ballot::test {

namespace fs = std::filesystem;

inline const std::string kScene = std::string(BALLOT_SOURCE_DIR) + "/scenes/cornell.gltf";

inline void pause_ms(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

class WindowTest : public testing::Test {
 protected:
  fs::path folder_ = fs::temp_directory_path() / fmt::format("ballot-view-{}", getpid());

  void SetUp() override {
    fs::create_directories(folder_);
    fs::copy(fs::path(BALLOT_SOURCE_DIR) / "shaders", folder_ / "shaders", fs::copy_options::recursive);
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// Returns the environment of a program. An empty name means no display.
  std::vector<std::string> environment(const std::string& display) const {
    std::vector<std::string> e{"BALLOT_SHADERS=" + (folder_ / "shaders").string(), "WAYLAND_DISPLAY",
                               "XDG_CACHE_HOME=" BALLOT_TEST_CACHE};
    e.push_back(display.empty() ? "DISPLAY" : "DISPLAY=" + display);
    return e;
  }
  std::vector<std::string> view(const std::string& size, const std::vector<std::string>& more,
                                const std::string& scene = kScene) const {
    std::vector<std::string> words{BALLOT_BINARY, "view", scene,   "--device",      "cpu",
                                   "--size",      size,   "--out", folder_.string()};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  /// Returns the picture that `ballot render` makes of a view of the scene, or of a view in `views` if that is not
  /// empty.
  Image rendered(const fs::path& views, const std::string& name, const std::string& size) const {
    const fs::path exr = folder_ / "rendered.exr";
    std::vector<std::string> words{BALLOT_BINARY, "render", kScene, "--device", "cpu",       "--view",
                                   name,          "--size", size,   "--out",    exr.string()};
    if (!views.empty()) words.insert(words.end(), {"--views-file", views.string()});
    Program render(words, environment(""));
    EXPECT_EQ(render.wait(60), 0) << render.output();
    return read_exr(exr);
  }
};

}  // namespace ballot::test
