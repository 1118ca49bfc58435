// GLFW, found at run time: every other command works on machines without it or without a display.
#pragma once

#include "engine/ballot.h"

// After ballot.h: where Vulkan's types are known, GLFW's header declares its functions for them.
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

// clang-format off
#define BALLOT_GLFW(X) \
  X(glfwInit) X(glfwTerminate) X(glfwGetError) X(glfwWindowHint) X(glfwCreateWindow) X(glfwDestroyWindow) \
  X(glfwWindowShouldClose) X(glfwSetWindowShouldClose) X(glfwPollEvents) X(glfwWaitEventsTimeout) \
  X(glfwGetFramebufferSize) X(glfwGetWindowSize) X(glfwSetWindowSize) X(glfwGetWindowPos) \
  X(glfwGetWindowContentScale) X(glfwSetWindowTitle) X(glfwSetWindowMonitor) X(glfwGetWindowMonitor) \
  X(glfwGetPrimaryMonitor) X(glfwGetVideoMode) X(glfwSetWindowUserPointer) X(glfwGetWindowUserPointer) \
  X(glfwSetKeyCallback) X(glfwSetCharCallback) X(glfwSetCursorPosCallback) X(glfwSetMouseButtonCallback) \
  X(glfwSetScrollCallback) X(glfwSetDropCallback) X(glfwSetWindowFocusCallback) X(glfwSetWindowIconifyCallback) X(glfwSetInputMode) \
  X(glfwGetRequiredInstanceExtensions) X(glfwVulkanSupported) X(glfwCreateWindowSurface)
// clang-format on

namespace ballot::view {

/// The functions that Ballot calls, under their own names.
struct Glfw {
#define BALLOT_GLFW_MEMBER(f) decltype(&::f) f = nullptr;
  BALLOT_GLFW(BALLOT_GLFW_MEMBER)
#undef BALLOT_GLFW_MEMBER
};

/// Loads GLFW and opens the display, once. Throws Error(Device) that names `ballot render` if there is none.
const Glfw& glfw();

}  // namespace ballot::view
