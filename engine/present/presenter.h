// Shows pictures in a window, with an overlay painted over them.
#pragma once

#include <array>
#include <memory>

#include "engine/present/painter.h"
#include "engine/present/swapchain.h"

namespace ballot {

/// Rows of 8-bit pixels from the top, in the order that Presenter::swap_red() asks for.
struct ShownPicture {
  const Buffer<std::uint32_t>* pixels = nullptr;
  std::uint32_t width = 0, height = 0;
};

/// Owns a window's swapchain; two frames are in flight. Made by an Engine that was opened with a window.
class Presenter {
 public:
  /// Throws Error(Device) if the window takes no 8-bit colours, Error(Work) if something cannot be made.
  Presenter(Context& gpu, Pace pace);
  ~Presenter();
  Presenter(const Presenter&) = delete;
  Presenter& operator=(const Presenter&) = delete;

  void set_atlas(const PaintAtlas& atlas);

  /// Stretches the picture over a window of window_width x window_height pixels (linear filter; none if the sizes are
  /// equal), paints the list over it, and presents. Follows the window's size by itself. The picture may be written again
  /// by later submissions. False: nothing was shown, since the window has no area or its size is just changing.
  bool show(const ShownPicture& picture, const PaintList& list, std::uint32_t window_width,
            std::uint32_t window_height);

  bool swap_red() const { return swapchain_.format() == VK_FORMAT_B8G8R8A8_UNORM; }
  /// Device milliseconds of copying, stretching and painting, of a frame that was shown shortly before.
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
  VkImage small_ = VK_NULL_HANDLE;  // what is stretched
  VkDeviceMemory small_memory_ = VK_NULL_HANDLE;
  VkExtent2D small_size_{};
  bool linear_ = false;
  double last_ms_ = 0;
};

}  // namespace ballot
