// A desktop window and its input events.
#pragma once

#include <glm/vec2.hpp>
#include <string>
#include <vector>

#include "tools/view/glfw.h"

namespace ballot::view {

struct KeyPress {
  int key = 0;   // GLFW_KEY_*
  int mods = 0;  // GLFW_MOD_*
};

/// The events of one frame, and the keys and buttons held down at its end. Positions are window coordinates from the
/// top left.
struct Input {
  std::vector<KeyPress> pressed;  // without key repeats
  std::vector<unsigned> typed;    // Unicode code points
  std::vector<std::string> dropped;
  bool down[GLFW_KEY_LAST + 1] = {};
  bool buttons[3] = {};  // held down: left, right, middle
  bool clicked[3] = {};  // the button went down in this frame
  glm::dvec2 mouse{-1e9};
  glm::dvec2 dragged[3] = {};  // mouse movement while the button was down, even if it is up again
  double scrolled = 0;
  bool minimised = false;

  void begin_frame();  // forgets the events and keeps the held keys and buttons
};

class Window {
 public:
  /// Opens a window of this size in screen units. Throws Error(Device) if there is no display or Vulkan cannot present
  /// to it.
  Window(const std::string& title, std::uint32_t width, std::uint32_t height);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Collects events. Waits up to wait_s seconds for the first one; 0: does not wait.
  void poll(double wait_s);
  Input& input() { return input_; }

  bool closed() const { return glfw().glfwWindowShouldClose(handle_) != 0; }
  void close() { glfw().glfwSetWindowShouldClose(handle_, 1); }
  glm::uvec2 pixels() const { return pixels_; }  // size of the framebuffer; this and size() are as of the last poll()
  glm::dvec2 size() const { return size_; }      // screen units
  bool minimised() const { return input_.minimised || pixels_.x == 0 || pixels_.y == 0; }
  double content_scale() const;  // the factor by which text must be larger on this screen
  void toggle_full_screen();
  void set_title(const std::string& title) { glfw().glfwSetWindowTitle(handle_, title.c_str()); }

  /// Returns the surface for DeviceSceneOptions; the window must outlive the DeviceScene.
  WindowSurface surface() const;

 private:
  void set_callbacks();
  void ask_size();

  GLFWwindow* handle_ = nullptr;
  glm::uvec2 pixels_{0};
  glm::dvec2 size_{0};
  Input input_;
  int before_[4] = {};  // position and size before full screen
};

}  // namespace ballot::view
