// A session of the viewer: the window, the engine, and the loop over frames.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "tools/view/camera.h"
#include "tools/view/overlay.h"
#include "tools/view/panels.h"
#include "tools/view/scaler.h"
#include "tools/view/window.h"

namespace ballot::view {

struct SessionOptions {
  std::string scene;
  LoadOptions load;  // of the scene
  DeviceSceneOptions world;
  Settings settings;
  bool target_given = false;  // false: the device decides settings.target_ms
  std::string view;           // the view to start with; empty: the place where the last session of this scene ended
  std::string views_file;     // the file to which key V appends; empty: SCENE-views.json in `out`
  std::string out = ".";      // folder for pictures
  std::uint32_t width = 1280, height = 720;
  std::size_t frames = 0;                  // turns the camera for so many frames, and ends; 0: until it is closed
  std::function<void(Scene&)> light = {};  // adds a sky and lamps to a scene that was loaded
};

class Session {
 public:
  /// Opens display, scene, window and device, in this order. Throws Error.
  explicit Session(SessionOptions options);

  /// Runs until the window is closed, or for SessionOptions::frames. Returns the number of validation messages.
  std::size_t run();
  /// Takes what the user did since the frame before, and shows the next one.
  void frame();

  Window& window() { return *window_; }
  DeviceScene& world() { return *world_; }
  Settings& settings() { return settings_; }
  const Facts& facts() const { return facts_; }

 private:
  using Clock = std::chrono::steady_clock;

  // session.cpp
  void make_overlay();
  glm::dvec2 screen_scale() const;
  void trace();
  void add_sample(std::uint32_t index, std::uint32_t count, double scale);
  bool announce_kernels();
  LiveOptions live_options(const glm::uvec2& size) const;
  void show();
  void note_time(double wall_ms);
  void say_times();
  bool at_rest() const;

  // session_input.cpp
  void take_keys();
  void take_key(const KeyPress& press);
  void choose_number(int digit);
  CameraInput take_mouse();
  void take_click();
  void hover();
  void pick(const glm::dvec2& mouse);
  void judge(Inspection& i, const Query& query);  // by the exact oracle
  void count();
  std::optional<glm::uvec2> pixel_at(const glm::dvec2& mouse) const;

  // session_play.cpp
  bool play(double dt);
  void toggle_play();

  // session_files.cpp
  void open(Scene scene);
  void open_dropped(const std::string& path);
  void load_views();
  void go_to(const View& view);
  std::filesystem::path saved_view_file() const;
  void save_view() const;
  std::filesystem::path views_file() const;
  void append_view();
  void shoot();
  std::filesystem::path next_shot() const;
  void watch_shaders();
  void reload(const char* why);

  void say(const std::string& message, bool failed = false);

  SessionOptions options_;
  Settings settings_;
  Display display_;  // opened first, so that a missing one is an error at once, not after minutes of loading
  std::unique_ptr<Window> window_;
  std::unique_ptr<DeviceScene> world_;
  std::unique_ptr<Presenter> presenter_;
  std::unique_ptr<Overlay> overlay_;
  std::unique_ptr<FlyCamera> camera_;
  Scaler scaler_{50};
  Facts facts_;
  std::vector<View> views_;  // the scene's views, then those of the views file

  /// A sample that is not finished yet.
  struct Part {
    std::uint32_t index, count;  // LiveOptions::sample_index, sample_count
  };
  std::optional<Part> part_;
  std::pair<std::size_t, double> shown_time_{0, 0.0};  // clip and time; at first the scene is at rest

  bool dirty_ = true;              // the picture must be started again
  bool moved_ = false;             // camera or scene moved in this frame
  bool jittered_ = false;          // the picture's samples are jittered
  Settings last_good_;             // the last settings that traced without an error
  std::set<std::string> kernels_;  // kernels that were compiled or announced
  int announced_ = 0;              // frames for which the announcement is still shown
  glm::uvec2 traced_{0}, window_pixels_{0};
  glm::dvec2 overlay_scale_{0};  // the screen_scale() that the overlay was made for
  Clock::time_point last_frame_ = Clock::now();
  double raw_wall_ms_ = 0, wall_ms_ = 0;  // time from frame to frame: the last one, and a running mean
  glm::dvec2 pressed_at_{0};
  bool dragged_ = false, over_panel_ = false;
  std::filesystem::path shaders_ = shader_folder();
  std::filesystem::file_time_type shaders_of_;  // when the newest of them was written
  Clock::time_point looked_ = Clock::now();     // when that was looked up
  std::size_t shown_frames_ = 0;                // that traced something
};

}  // namespace ballot::view
