// Two-dimensional images of one level and layer. Internal to engine/present.
#pragma once

#include <string>

#include "engine/vk/context.h"

namespace ballot {

/// What a command makes of an image.
struct Use {
  VkImageLayout layout;
  VkPipelineStageFlags stage;
  VkAccessFlags access;
};

/// Orders two uses of an image and changes its layout.
void change_use(const Vulkan& vk, VkCommandBuffer cmd, VkImage image, const Use& from, const Use& to);

/// Owned by the caller, as is `memory`. Throws Error(Work) that names the image.
VkImage create_image(Context& gpu, VkExtent2D size, VkFormat format, VkImageUsageFlags usage, const std::string& name,
                     VkDeviceMemory& memory);
VkImageView create_view(Context& gpu, VkImage image, VkFormat format, const std::string& name);

}  // namespace ballot
