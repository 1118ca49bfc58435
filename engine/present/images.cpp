#include "engine/present/images.h"

namespace ballot {

void change_use(const Vulkan& vk, VkCommandBuffer cmd, VkImage image, const Use& from, const Use& to) {
  VkImageMemoryBarrier barrier{};
  barrier.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER;
  barrier.srcAccessMask = from.access;
  barrier.dstAccessMask = to.access;
  barrier.oldLayout = from.layout;
  barrier.newLayout = to.layout;
  barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  barrier.image = image;
  barrier.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
  vk.CmdPipelineBarrier(cmd, from.stage, to.stage, 0, 0, nullptr, 0, nullptr, 1, &barrier);
}

VkImage create_image(Context& gpu, VkExtent2D size, VkFormat format, VkImageUsageFlags usage, const std::string& name,
                     VkDeviceMemory& memory) {
  VkImageCreateInfo create{};
  create.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO;
  create.imageType = VK_IMAGE_TYPE_2D;
  create.format = format;
  create.extent = {size.width, size.height, 1};
  create.mipLevels = create.arrayLayers = 1;
  create.samples = VK_SAMPLE_COUNT_1_BIT;
  create.usage = usage;
  VkImage image = VK_NULL_HANDLE;
  vk_check(gpu.vk().CreateImage(gpu.device(), &create, nullptr, &image), "creating image", name.c_str());
  VkMemoryRequirements needs;
  gpu.vk().GetImageMemoryRequirements(gpu.device(), image, &needs);
  VkMemoryAllocateInfo allocate{};
  allocate.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
  allocate.allocationSize = needs.size;
  try {
    allocate.memoryTypeIndex = gpu.memory_type(needs.memoryTypeBits, 0, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
    vk_check(gpu.vk().AllocateMemory(gpu.device(), &allocate, nullptr, &memory), "allocating image", name.c_str());
    vk_check(gpu.vk().BindImageMemory(gpu.device(), image, memory, 0), "binding image", name.c_str());
  } catch (...) {
    gpu.vk().DestroyImage(gpu.device(), image, nullptr);
    gpu.vk().FreeMemory(gpu.device(), memory, nullptr);
    memory = VK_NULL_HANDLE;
    throw;
  }
  gpu.name(VK_OBJECT_TYPE_IMAGE, std::uint64_t(image), name);
  return image;
}

VkImageView create_view(Context& gpu, VkImage image, VkFormat format, const std::string& name) {
  VkImageViewCreateInfo create{};
  create.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO;
  create.image = image;
  create.viewType = VK_IMAGE_VIEW_TYPE_2D;
  create.format = format;
  create.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
  VkImageView view = VK_NULL_HANDLE;
  vk_check(gpu.vk().CreateImageView(gpu.device(), &create, nullptr, &view), "creating a view of image", name.c_str());
  return view;
}

}  // namespace ballot
