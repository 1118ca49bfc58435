// The swapchain of a window, recreated when the window's size changes. Internal to engine/present.
#pragma once

#include <vector>

#include "engine/vk/context.h"

namespace ballot {

/// How finished pictures reach the screen. Neither mode tears.
enum class Pace {
  Refresh,  // FIFO: every picture waits for a refresh of the screen
  Latest,   // mailbox, or FIFO if the device has no mailbox: shows the newest picture and drops older ones
};

/// Owns the swapchain, its image views and its framebuffers.
class Swapchain {
 public:
  /// Throws Error(Device) if the surface offers no 8-bit colours.
  Swapchain(Context& gpu, Pace pace);
  ~Swapchain();
  Swapchain(const Swapchain&) = delete;
  Swapchain& operator=(const Swapchain&) = delete;

  /// Creates the images for a window of this many pixels, after waiting until the old ones are no longer in use.
  /// Returns false if the window has no area; there are no images then. Throws Error(Work).
  bool create(VkRenderPass pass, VkExtent2D window);
  bool exists() const { return swapchain_ != VK_NULL_HANDLE; }

  struct Image {
    VkImage image = VK_NULL_HANDLE;
    VkImageView view = VK_NULL_HANDLE;
    VkFramebuffer framebuffer = VK_NULL_HANDLE;
    VkSemaphore painted = VK_NULL_HANDLE;  // presenting waits for it
  };
  /// Writes the index of the next image to `index`. `ready` is signalled when the image can be drawn to.
  VkResult acquire(VkSemaphore ready, std::uint32_t& index);
  /// Presents an image once its semaphore `painted` is signalled.
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
