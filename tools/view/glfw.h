// GLFW, loaded at run time, so that every other command works on machines without GLFW or without a display.
#pragma once

#include "engine/scene/device_scene.h"

// Included after ballot.h: GLFW's header declares its Vulkan functions only if Vulkan's types are known.
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

// clang-format off
#define BALLOT_GLFW(X) \
  X(glfwInit) X(glfwTerminate) X(glfwGetError) X(glfwWindowHint) X(glfwCreateWindow) X(glfwDestroyWindow) \
  X(glfwWindowShouldClose) X(glfwSetWindowShouldClose) X(glfwPollEvents) X(glfwWaitEventsTimeout) \
  X(glfwGetFramebufferSize) X(glfwGetWindowSize) X(glfwGetWindowPos) \
  X(glfwGetWindowContentScale) X(glfwSetWindowTitle) X(glfwSetWindowMonitor) X(glfwGetWindowMonitor) \
  X(glfwGetPrimaryMonitor) X(glfwGetVideoMode) X(glfwSetWindowUserPointer) X(glfwGetWindowUserPointer) \
  X(glfwSetKeyCallback) X(glfwSetCharCallback) X(glfwSetCursorPosCallback) X(glfwSetMouseButtonCallback) \
  X(glfwSetScrollCallback) X(glfwSetDropCallback) X(glfwSetWindowFocusCallback) X(glfwSetWindowIconifyCallback) \
  X(glfwSetInputMode) X(glfwGetRequiredInstanceExtensions) X(glfwVulkanSupported) X(glfwCreateWindowSurface)
// clang-format on

namespace ballot::view {

/// The GLFW functions that Ballot calls, under their own names.
struct Glfw {
#define BALLOT_GLFW_MEMBER(f) decltype(&::f) f = nullptr;
  BALLOT_GLFW(BALLOT_GLFW_MEMBER)
#undef BALLOT_GLFW_MEMBER
};

/// Returns GLFW's functions. The first call loads GLFW. Throws Error(Device) if there is none; the message names
/// `ballot render`, which needs none.
const Glfw& glfw();

/// The connection to the display; one at a time.
class Display {
 public:
  /// Throws Error(Device) as glfw() does, also if there is no display.
  Display();
  ~Display() { glfw().glfwTerminate(); }
  Display(const Display&) = delete;
  Display& operator=(const Display&) = delete;
};

}  // namespace ballot::view
