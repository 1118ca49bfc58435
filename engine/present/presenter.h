// Shows pictures in a window, with a user interface painted over them.
#pragma once

#include <array>
#include <memory>

#include "engine/present/painter.h"
#include "engine/present/swapchain.h"

namespace ballot {

/// A picture with 8 bits per channel, rows from the top. Presenter::swap_red() gives the order of the channels.
struct ShownPicture {
  const Buffer<std::uint32_t>* pixels = nullptr;
  std::uint32_t width = 0, height = 0;
};

/// Owns the swapchain of a window. Two frames are in flight. Made by an Engine that was opened with a window. Belongs
/// to one thread.
class Presenter {
 public:
  /// Throws Error(Device) if the window supports no 8-bit colours, Error(Work) if a Vulkan object cannot be created.
  Presenter(Context& gpu, Pace pace);
  ~Presenter();
  Presenter(const Presenter&) = delete;
  Presenter& operator=(const Presenter&) = delete;

  /// Replaces the atlas. Waits for the device first.
  void set_atlas(const PaintAtlas& atlas);

  /// Scales the picture to the window of window_width x window_height pixels (linear filter; none if the sizes are
  /// equal), paints the list over it, and presents it. Recreates the swapchain when the window's size changes. Later
  /// submissions may overwrite the picture. Returns false if nothing was shown, because the window has no area or its
  /// size is changing.
  /// Throws Error(Work).
  bool show(const ShownPicture& picture, const PaintList& list, std::uint32_t window_width,
            std::uint32_t window_height);

  /// Returns true if the lowest byte of a pixel must be blue, false if it must be red.
  bool swap_red() const { return swapchain_.format() == VK_FORMAT_B8G8R8A8_UNORM; }
  /// Returns the device milliseconds of copying, scaling and painting a recent frame.
  double last_ms() const { return last_ms_; }

 private:
  static constexpr std::uint32_t kFrames = 2;
  struct Frame {
    VkCommandBuffer commands = VK_NULL_HANDLE;
    VkSemaphore ready = VK_NULL_HANDLE;
    VkFence done = VK_NULL_HANDLE;
    bool timed = false;
  };

  void create_pass();
  void create_frames();
  void destroy();
  bool follow(VkExtent2D window);
  bool acquire(Frame& frame, VkExtent2D window, std::uint32_t& index);
  void read_time(std::uint32_t frame);
  void make_stretched(const ShownPicture& picture);
  void record(std::uint32_t frame, const Swapchain::Image& image, const ShownPicture& picture, const PaintList& list);
  void record_picture(VkCommandBuffer cmd, VkImage to, const ShownPicture& picture);

  Context& gpu_;
  Swapchain swapchain_;
  bool stale_ = true;
  VkRenderPass pass_ = VK_NULL_HANDLE;
  VkCommandPool commands_ = VK_NULL_HANDLE;
  VkQueryPool queries_ = VK_NULL_HANDLE;
  std::array<Frame, kFrames> frames_;
  std::uint32_t next_ = 0;
  std::unique_ptr<Painter> painter_;
  VkImage small_ = VK_NULL_HANDLE;  // the picture before it is scaled
  VkDeviceMemory small_memory_ = VK_NULL_HANDLE;
  VkExtent2D small_size_{};
  bool linear_ = false;
  double last_ms_ = 0;
};

}  // namespace ballot
