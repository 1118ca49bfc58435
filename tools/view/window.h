// A desktop window: what was typed, dragged and dropped since the last frame.
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

/// Events of one frame, and what is held down at its end. Positions are window coordinates from the top left.
struct Input {
  std::vector<KeyPress> pressed;  // repeats are left out
  std::vector<unsigned> typed;    // Unicode
  std::vector<std::string> dropped;
  bool down[GLFW_KEY_LAST + 1] = {};
  bool buttons[3] = {};  // left, right, middle
  bool clicked[3] = {};  // went down in this frame
  glm::dvec2 mouse{-1e9};
  glm::dvec2 dragged[3] = {};  // by which the mouse moved while the button was down, even if it is up again
  double scrolled = 0;
  bool minimised = false;

  void begin_frame();  // forgets events, keeps what is held
};

class Window {
 public:
  /// Opens a window of this many screen units. Throws Error(Device) without a display or Vulkan.
  Window(const std::string& title, std::uint32_t width, std::uint32_t height);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Collects events. Waits up to wait_s for the first one; 0: does not wait.
  void poll(double wait_s);
  Input& input() { return input_; }

  bool closed() const { return glfw().glfwWindowShouldClose(handle_) != 0; }
  void close() { glfw().glfwSetWindowShouldClose(handle_, 1); }
  glm::uvec2 pixels() const { return pixels_; }  // of the framebuffer; this and the size are those of the last poll()
  glm::dvec2 size() const { return size_; }      // screen units
  bool minimised() const { return input_.minimised || pixels_.x == 0 || pixels_.y == 0; }
  double content_scale() const;  // how much larger text is to be on this screen
  void resize(std::uint32_t width, std::uint32_t height);
  void toggle_full_screen();
  void set_title(const std::string& title) { glfw().glfwSetWindowTitle(handle_, title.c_str()); }

  /// For EngineOptions; the window must outlive the Engine.
  WindowSurface surface() const;

 private:
  void set_callbacks();
  void ask_size();

  GLFWwindow* handle_ = nullptr;
  glm::uvec2 pixels_{0};
  glm::dvec2 size_{0};
  Input input_;
  int before_[4] = {};  // place and size before full screen
};

}  // namespace ballot::view
