// The overlay: Dear ImGui, its input from a window, and its back end for Vulkan.
#pragma once

#include "tools/view/window.h"

namespace ballot::view {

/// The ImGui context of the overlay. Only one may exist at a time. Panels are ImGui calls between begin() and end().
class Overlay {
 public:
  /// Makes text `content_scale` times larger than on a screen of usual density. `pixels` is the number of pixels in a
  /// unit of the window's coordinates. `gpu` must outlive the Overlay, and `pass` the calls of paint(). Throws
  /// Error(Work).
  Overlay(Context& gpu, VkRenderPass pass, double content_scale, double pixels);
  ~Overlay();
  Overlay(const Overlay&) = delete;
  Overlay& operator=(const Overlay&) = delete;

  void begin(const Window& window, const Input& input, double dt);
  void end();
  /// Records the draws of what was made between begin() and end(), for Presenter::show().
  void paint(VkCommandBuffer cmd) const;

  /// takes_mouse(): the pointer is over a panel, or a panel holds it. takes_keys(): a panel receives the typed text.
  bool takes_mouse() const;
  bool takes_keys() const;

 private:
  void start_back_end(VkRenderPass pass);
  void destroy();

  Context& gpu_;
  VkDescriptorPool pool_ = VK_NULL_HANDLE;  // of the glyphs
};

/// Returns a function of Vulkan for the device of the Overlay that exists.
PFN_vkVoidFunction vulkan_function(const char* name);

}  // namespace ballot::view
