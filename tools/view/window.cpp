#include "tools/view/window.h"

namespace ballot::view {

namespace {

Input& input_of(GLFWwindow* window) { return static_cast<Window*>(glfw().glfwGetWindowUserPointer(window))->input(); }

void on_key(GLFWwindow* window, int key, int, int action, int mods) {
  if (key < 0 || key > GLFW_KEY_LAST) return;
  Input& input = input_of(window);
  input.down[key] = action != GLFW_RELEASE;
  if (action == GLFW_PRESS) input.pressed.push_back({key, mods});
}

void on_mouse(GLFWwindow* window, double x, double y) {
  Input& input = input_of(window);
  for (int b = 0; b < 3; ++b)
    if (input.buttons[b] && input.mouse.x > -1e8) input.dragged[b] += glm::dvec2(x, y) - input.mouse;
  input.mouse = {x, y};
}

void on_button(GLFWwindow* window, int button, int action, int) {
  if (button < 0 || button > 2) return;
  Input& input = input_of(window);
  input.buttons[button] = action == GLFW_PRESS;
  if (action == GLFW_PRESS) input.clicked[button] = true;
}

void on_drop(GLFWwindow* window, int count, const char** paths) {
  for (int i = 0; i < count; ++i) input_of(window).dropped.push_back(paths[i]);
}

void on_focus(GLFWwindow* window, int focused) {
  Input& input = input_of(window);
  // The release of a key while another window has the focus may send no event here.
  if (!focused) std::fill(std::begin(input.down), std::end(input.down), false);
}

}  // namespace

void Input::begin_frame() {
  pressed.clear();
  typed.clear();
  dropped.clear();
  for (bool& c : clicked) c = false;
  for (glm::dvec2& d : dragged) d = {0, 0};
  scrolled = 0;
}

Window::Window(const std::string& title, std::uint32_t width, std::uint32_t height) {
  const Glfw& g = glfw();
  if (!g.glfwVulkanSupported())
    fail(Failure::Device,
         "Vulkan cannot present to this display (it needs a Vulkan loader and a driver with VK_KHR_xcb_surface or the "
         "like); 'ballot render' writes pictures without a window");
  g.glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
  g.glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
  handle_ = g.glfwCreateWindow(int(width), int(height), title.c_str(), nullptr, nullptr);
  if (!handle_) {
    const char* why = "";
    g.glfwGetError(&why);
    fail(Failure::Device, "no window could be opened ({}); 'ballot render' writes pictures without one",
         why ? why : "no reason given");
  }
  g.glfwSetWindowUserPointer(handle_, this);
  set_callbacks();
  ask_size();
}

void Window::set_callbacks() {
  const Glfw& g = glfw();
  g.glfwSetKeyCallback(handle_, on_key);
  g.glfwSetCharCallback(handle_, [](GLFWwindow* w, unsigned code) { input_of(w).typed.push_back(code); });
  g.glfwSetCursorPosCallback(handle_, on_mouse);
  g.glfwSetMouseButtonCallback(handle_, on_button);
  g.glfwSetScrollCallback(handle_, [](GLFWwindow* w, double, double y) { input_of(w).scrolled += y; });
  g.glfwSetDropCallback(handle_, on_drop);
  g.glfwSetWindowFocusCallback(handle_, on_focus);
  // Some desktops give a minimised window the size 0; others (X11) leave its size unchanged.
  g.glfwSetWindowIconifyCallback(handle_, [](GLFWwindow* w, int yes) { input_of(w).minimised = yes != 0; });
}

Window::~Window() { glfw().glfwDestroyWindow(handle_); }

void Window::poll(double wait_s) {
  input_.begin_frame();
  if (wait_s > 0)
    glfw().glfwWaitEventsTimeout(wait_s);
  else
    glfw().glfwPollEvents();
  ask_size();
}

// Called once a frame, because under X11 each query is a round trip to the server.
void Window::ask_size() {
  int width = 0, height = 0;
  glfw().glfwGetFramebufferSize(handle_, &width, &height);
  pixels_ = {std::uint32_t(width), std::uint32_t(height)};
  glfw().glfwGetWindowSize(handle_, &width, &height);
  size_ = {width, height};
}

double Window::content_scale() const {
  float x = 1, y = 1;
  glfw().glfwGetWindowContentScale(handle_, &x, &y);
  return x > 0 ? double(x) : 1;
}

void Window::toggle_full_screen() {
  const Glfw& g = glfw();
  if (g.glfwGetWindowMonitor(handle_)) {
    g.glfwSetWindowMonitor(handle_, nullptr, before_[0], before_[1], before_[2], before_[3], GLFW_DONT_CARE);
    return;
  }
  GLFWmonitor* monitor = g.glfwGetPrimaryMonitor();
  const GLFWvidmode* mode = monitor ? g.glfwGetVideoMode(monitor) : nullptr;
  if (!mode) return;
  g.glfwGetWindowPos(handle_, &before_[0], &before_[1]);
  g.glfwGetWindowSize(handle_, &before_[2], &before_[3]);
  g.glfwSetWindowMonitor(handle_, monitor, 0, 0, mode->width, mode->height, mode->refreshRate);
}

WindowSurface Window::surface() const {
  WindowSurface surface;
  std::uint32_t count = 0;
  const char** names = glfw().glfwGetRequiredInstanceExtensions(&count);
  surface.instance_extensions.assign(names, names + count);
  surface.create = [handle = handle_](VkInstance instance) {
    VkSurfaceKHR made = VK_NULL_HANDLE;
    if (glfw().glfwCreateWindowSurface(instance, handle, nullptr, &made) != VK_SUCCESS) {
      const char* why = "";
      glfw().glfwGetError(&why);
      fail(Failure::Device, "Vulkan cannot draw to this window ({}); 'ballot render' writes pictures without one",
           why ? why : "no reason given");
    }
    return made;
  };
  return surface;
}

}  // namespace ballot::view
