// The images of a window, made anew when its size changes. Internal to engine/present.
#pragma once

#include <vector>

#include "engine/vk/context.h"

namespace ballot {

/// How a finished picture reaches the screen. Neither tears.
enum class Pace {
  Refresh,  // FIFO: waits for the screen
  Latest,   // mailbox where the device has it: the newest picture is shown, older ones are dropped
};

class Swapchain {
 public:
  /// Throws Error(Device) if the surface offers no 8-bit colours.
  Swapchain(Context& gpu, Pace pace);
  ~Swapchain();
  Swapchain(const Swapchain&) = delete;
  Swapchain& operator=(const Swapchain&) = delete;

  /// Makes images for a window of this many pixels, once nothing of the old ones is in use. False: the window has no
  /// area now, and there are no images.
  bool create(VkRenderPass pass, VkExtent2D window);
  bool exists() const { return swapchain_ != VK_NULL_HANDLE; }

  struct Image {
    VkImage image = VK_NULL_HANDLE;
    VkImageView view = VK_NULL_HANDLE;
    VkFramebuffer framebuffer = VK_NULL_HANDLE;
    VkSemaphore painted = VK_NULL_HANDLE;  // presenting waits for it
  };
  /// The index of the next image in `index`; `ready` is signalled when it can be drawn to.
  VkResult acquire(VkSemaphore ready, std::uint32_t& index);
  VkResult present(std::uint32_t index);

  const Image& operator[](std::uint32_t index) const { return images_[index]; }
  VkFormat format() const { return format_.format; }
  VkExtent2D extent() const { return extent_; }

 private:
  void create_images(VkRenderPass pass);
  void destroy_images();

  Context& gpu_;
  VkSurfaceFormatKHR format_{};
  VkPresentModeKHR mode_ = VK_PRESENT_MODE_FIFO_KHR;
  VkSwapchainKHR swapchain_ = VK_NULL_HANDLE;
  VkExtent2D extent_{};
  std::vector<Image> images_;
};

}  // namespace ballot
