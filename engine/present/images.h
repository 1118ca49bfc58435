// Two-dimensional images of one level and layer. Internal to engine/present.
#pragma once

#include <string>

#include "engine/vk/context.h"

namespace ballot {

/// A use of an image by a command: the layout, the stage and the access.
struct Use {
  VkImageLayout layout;
  VkPipelineStageFlags stage;
  VkAccessFlags access;
};

/// Records a barrier between two uses of an image, with the change of its layout.
void change_use(const Vulkan& vk, VkCommandBuffer cmd, VkImage image, const Use& from, const Use& to);

/// Creates an image and its memory. The caller owns both. Throws Error(Work) that names the image.
VkImage create_image(Context& gpu, VkExtent2D size, VkFormat format, VkImageUsageFlags usage, const std::string& name,
                     VkDeviceMemory& memory);
/// Creates a view of an image. The caller owns it. Throws Error(Work) that names the image.
VkImageView create_view(Context& gpu, VkImage image, VkFormat format, const std::string& name);

}  // namespace ballot
