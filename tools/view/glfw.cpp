#include "tools/view/glfw.h"

#include <dlfcn.h>

namespace ballot::view {

namespace {

constexpr const char* kInstead = "'ballot render' writes pictures without a window";

Glfw load() {
  void* library = dlopen("libglfw.so.3", RTLD_NOW | RTLD_LOCAL);
  if (!library)
    fail(Failure::Device, "ballot view needs GLFW, but found no libglfw.so.3; on Debian: apt install libglfw3; {}",
         kInstead);
  Glfw g;
#define BALLOT_GLFW_LOAD(f)                                  \
  g.f = reinterpret_cast<decltype(g.f)>(dlsym(library, #f)); \
  if (!g.f) fail(Failure::Device, "libglfw.so.3 has no " #f "; ballot view needs GLFW 3.3 or newer; {}", kInstead);
  BALLOT_GLFW(BALLOT_GLFW_LOAD)
#undef BALLOT_GLFW_LOAD
  return g;
}

}  // namespace

const Glfw& glfw() {
  static const Glfw functions = load();
  return functions;
}

Display::Display() {
  if (glfw().glfwInit()) return;
  const char* why = "";
  glfw().glfwGetError(&why);
  fail(Failure::Device, "ballot view found no display ({}); {}", why ? why : "no reason given", kInstead);
}

}  // namespace ballot::view
