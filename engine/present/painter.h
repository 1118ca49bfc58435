// Paints the triangles of a user interface over the picture of a window, one draw call per command. It does not depend
// on any user interface toolkit.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "engine/vk/buffer.h"
#include "shaders/shared/paint.h"

namespace ballot {

/// A range of triangles that share a clip rectangle.
struct PaintCommand {
  std::uint32_t first_index = 0, index_count = 0;
  std::uint32_t first_vertex = 0;  // added to every index
  std::int32_t x = 0, y = 0;       // clip rectangle, in window pixels from the top left
  std::uint32_t width = 0, height = 0;
};

/// The commands of a frame. They are painted in order, each over the earlier ones; alpha is not premultiplied.
struct PaintList {
  std::vector<PaintVertex> vertices;
  std::vector<std::uint32_t> indices;
  std::vector<PaintCommand> commands;
};

/// The coverage texture that PaintVertex::u and v address: one byte per pixel, rows from the top.
struct PaintAtlas {
  std::uint32_t width = 0, height = 0;
  std::span<const unsigned char> coverage;
};

/// The pipeline that paints lists. Belongs to one thread.
class Painter {
 public:
  /// Up to `frames` paint lists may be in flight at once. Throws Error(Work).
  Painter(Context& gpu, VkRenderPass pass, std::uint32_t frames);
  ~Painter();
  Painter(const Painter&) = delete;
  Painter& operator=(const Painter&) = delete;

  /// Replaces the atlas. No submission may be pending.
  void set_atlas(const PaintAtlas& atlas);

  /// Uploads a list for frame number `frame`. The device must have finished the last use of that frame.
  void upload(std::uint32_t frame, const PaintList& list);
  /// Records the draws of the uploaded list inside the render pass, for a target of size `area`. Does nothing without
  /// an atlas.
  void record(VkCommandBuffer cmd, std::uint32_t frame, const PaintList& list, VkExtent2D area);

 private:
  struct Frame {
    std::unique_ptr<Buffer<PaintVertex>> vertices;
    std::unique_ptr<Buffer<std::uint32_t>> indices;
    VkDescriptorSet set = VK_NULL_HANDLE;
  };

  void create_layout(std::uint32_t frames);
  void create_pipeline(VkRenderPass pass);
  void create_atlas_image(const PaintAtlas& atlas);
  void destroy_atlas();
  void destroy();

  Context& gpu_;
  std::vector<Frame> frames_;
  VkSampler sampler_ = VK_NULL_HANDLE;
  VkDescriptorSetLayout set_layout_ = VK_NULL_HANDLE;
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  VkDescriptorPool pool_ = VK_NULL_HANDLE;
  VkPipeline pipeline_ = VK_NULL_HANDLE;
  VkImage atlas_ = VK_NULL_HANDLE;
  VkDeviceMemory atlas_memory_ = VK_NULL_HANDLE;
  VkImageView atlas_view_ = VK_NULL_HANDLE;
};

}  // namespace ballot
