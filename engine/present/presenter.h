// Shows pictures in a window, with a user interface painted over them.
#pragma once

#include <functional>
#include <vector>

#include "engine/gpu/buffer.h"

namespace ballot {

/// A picture with 8 bits per channel, blue in the lowest byte, rows from the top.
struct ShownPicture {
  const Buffer<std::uint32_t>* pixels = nullptr;
  std::uint32_t width = 0, height = 0;
};

/// Owns the swapchain of a window. Made by a DeviceScene that was opened with a window. Belongs to one thread.
class Presenter {
 public:
  /// Records draws inside the render pass pass(), whose target has the size of the window.
  using Paint = std::function<void(VkCommandBuffer)>;

  /// Throws Error(Device) if the window does not show such pixels, Error(Work) if a Vulkan object cannot be created.
  explicit Presenter(Context& gpu);
  ~Presenter();
  Presenter(const Presenter&) = delete;
  Presenter& operator=(const Presenter&) = delete;

  /// Scales the picture to the window of window_width x window_height pixels (linear filter; none if the sizes are
  /// equal), paints over it, presents it, and waits for the device. Recreates the swapchain when the window's size
  /// changes. Returns false if nothing was shown, because the window has no area or its size is changing.
  /// Throws Error(Work), and what `paint` throws.
  bool show(const ShownPicture& picture, const Paint& paint, std::uint32_t window_width, std::uint32_t window_height);

  VkRenderPass pass() const { return pass_; }
  /// Returns the device milliseconds of copying, scaling and painting the last frame.
  double last_ms() const { return last_ms_; }

 private:
  struct Image {
    VkImage image = VK_NULL_HANDLE;
    VkImageView view = VK_NULL_HANDLE;
    VkFramebuffer framebuffer = VK_NULL_HANDLE;
  };

  void create_pass();
  void create_swapchain(VkExtent2D window);
  void create_images();
  void destroy_images();
  void destroy_small();
  void destroy();
  bool acquire(VkExtent2D window, std::uint32_t& index);
  void make_small(const ShownPicture& picture);
  void record(VkCommandBuffer cmd, const Image& image, const ShownPicture& picture, const Paint& paint);
  void record_picture(VkCommandBuffer cmd, VkImage to, const ShownPicture& picture);
  bool fits(const ShownPicture& p) const { return p.width == extent_.width && p.height == extent_.height; }

  Context& gpu_;
  VkRenderPass pass_ = VK_NULL_HANDLE;
  VkFence acquired_ = VK_NULL_HANDLE;
  VkSwapchainKHR swapchain_ = VK_NULL_HANDLE;
  VkExtent2D extent_{};  // of the swapchain
  bool stale_ = true;    // the swapchain must be created again
  std::vector<Image> images_;
  VkImage small_ = VK_NULL_HANDLE;  // the picture before it is scaled
  VkDeviceMemory small_memory_ = VK_NULL_HANDLE;
  VkExtent2D small_size_{};
  double last_ms_ = 0;
};

}  // namespace ballot
