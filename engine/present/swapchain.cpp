#include "engine/present/swapchain.h"

#include <algorithm>

#include "engine/core/error.h"
#include "engine/present/images.h"

namespace ballot {

namespace {

/// Returns an 8-bit UNORM format of the window. The pixels are sRGB encoded already: a UNORM format stores them as they
/// are, an SRGB format would encode them again.
VkSurfaceFormatKHR choose_format(Context& gpu) {
  std::uint32_t count = 0;
  vk_check(gpu.vk().GetPhysicalDeviceSurfaceFormatsKHR(gpu.physical(), gpu.surface(), &count, nullptr),
           "asking for the window's formats");
  std::vector<VkSurfaceFormatKHR> formats(count);
  vk_check(gpu.vk().GetPhysicalDeviceSurfaceFormatsKHR(gpu.physical(), gpu.surface(), &count, formats.data()),
           "asking for the window's formats");
  for (const VkFormat wanted : {VK_FORMAT_B8G8R8A8_UNORM, VK_FORMAT_R8G8B8A8_UNORM})
    for (const VkSurfaceFormatKHR& f : formats)
      if (f.format == wanted && f.colorSpace == VK_COLOR_SPACE_SRGB_NONLINEAR_KHR) return f;
  fail(Failure::Device, "{} offers this window none of the formats BGRA and RGBA with 8 bits; use another --device",
       gpu.info().name);
}

VkPresentModeKHR choose_mode(Context& gpu, Pace pace) {
  std::uint32_t count = 0;
  vk_check(gpu.vk().GetPhysicalDeviceSurfacePresentModesKHR(gpu.physical(), gpu.surface(), &count, nullptr),
           "asking how the window presents");
  std::vector<VkPresentModeKHR> modes(count);
  vk_check(gpu.vk().GetPhysicalDeviceSurfacePresentModesKHR(gpu.physical(), gpu.surface(), &count, modes.data()),
           "asking how the window presents");
  const bool mailbox = std::ranges::count(modes, VK_PRESENT_MODE_MAILBOX_KHR) > 0;
  return pace == Pace::Latest && mailbox ? VK_PRESENT_MODE_MAILBOX_KHR : VK_PRESENT_MODE_FIFO_KHR;
}

}  // namespace

Swapchain::Swapchain(Context& gpu, Pace pace) : gpu_(gpu), format_(choose_format(gpu)), mode_(choose_mode(gpu, pace)) {}

Swapchain::~Swapchain() {
  destroy_images();
  gpu_.vk().DestroySwapchainKHR(gpu_.device(), swapchain_, nullptr);
}

void Swapchain::destroy_images() {
  for (const Image& i : images_) {
    gpu_.vk().DestroySemaphore(gpu_.device(), i.painted, nullptr);
    gpu_.vk().DestroyFramebuffer(gpu_.device(), i.framebuffer, nullptr);
    gpu_.vk().DestroyImageView(gpu_.device(), i.view, nullptr);
  }
  images_.clear();
}

bool Swapchain::create(VkRenderPass pass, VkExtent2D window) {
  VkSurfaceCapabilitiesKHR can{};
  vk_check(gpu_.vk().GetPhysicalDeviceSurfaceCapabilitiesKHR(gpu_.physical(), gpu_.surface(), &can),
           "asking what the window can do");
  VkExtent2D extent = can.currentExtent;
  if (extent.width == 0xFFFFFFFF) {  // the window takes the size of the swapchain
    extent.width = std::clamp(window.width, can.minImageExtent.width, can.maxImageExtent.width);
    extent.height = std::clamp(window.height, can.minImageExtent.height, can.maxImageExtent.height);
  }
  vk_check(gpu_.vk().DeviceWaitIdle(gpu_.device()), "waiting for the window's images");
  destroy_images();
  const VkSwapchainKHR old = swapchain_;
  swapchain_ = VK_NULL_HANDLE;
  extent_ = extent;
  VkResult result = VK_SUCCESS;
  if (extent.width && extent.height) {
    VkSwapchainCreateInfoKHR create{};
    create.sType = VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR;
    create.surface = gpu_.surface();
    create.minImageCount = can.minImageCount + 1;
    if (can.maxImageCount) create.minImageCount = std::min(create.minImageCount, can.maxImageCount);
    create.imageFormat = format_.format;
    create.imageColorSpace = format_.colorSpace;
    create.imageExtent = extent;
    create.imageArrayLayers = 1;
    create.imageUsage = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;
    create.preTransform = can.currentTransform;
    create.compositeAlpha = VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR;
    create.presentMode = mode_;
    create.clipped = VK_TRUE;
    create.oldSwapchain = old;
    result = gpu_.vk().CreateSwapchainKHR(gpu_.device(), &create, nullptr, &swapchain_);
  }
  gpu_.vk().DestroySwapchainKHR(gpu_.device(), old, nullptr);
  vk_check(result, "creating the window's images");
  if (!swapchain_) return false;
  create_images(pass);
  return true;
}

void Swapchain::create_images(VkRenderPass pass) {
  std::uint32_t count = 0;
  vk_check(gpu_.vk().GetSwapchainImagesKHR(gpu_.device(), swapchain_, &count, nullptr),
           "asking for the window's images");
  std::vector<VkImage> handles(count);
  vk_check(gpu_.vk().GetSwapchainImagesKHR(gpu_.device(), swapchain_, &count, handles.data()),
           "asking for the window's images");
  for (const VkImage handle : handles) {
    Image& i = images_.emplace_back();
    i.image = handle;
    i.view = create_view(gpu_, handle, format_.format, "window");
    VkFramebufferCreateInfo framebuffer{};
    framebuffer.sType = VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO;
    framebuffer.renderPass = pass;
    framebuffer.attachmentCount = 1;
    framebuffer.pAttachments = &i.view;
    framebuffer.width = extent_.width;
    framebuffer.height = extent_.height;
    framebuffer.layers = 1;
    vk_check(gpu_.vk().CreateFramebuffer(gpu_.device(), &framebuffer, nullptr, &i.framebuffer),
             "creating a framebuffer");
    VkSemaphoreCreateInfo semaphore{};
    semaphore.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO;
    vk_check(gpu_.vk().CreateSemaphore(gpu_.device(), &semaphore, nullptr, &i.painted), "creating a semaphore");
  }
}

VkResult Swapchain::acquire(VkSemaphore ready, std::uint32_t& index) {
  return gpu_.vk().AcquireNextImageKHR(gpu_.device(), swapchain_, UINT64_MAX, ready, VK_NULL_HANDLE, &index);
}

VkResult Swapchain::present(std::uint32_t index) {
  VkPresentInfoKHR present{};
  present.sType = VK_STRUCTURE_TYPE_PRESENT_INFO_KHR;
  present.waitSemaphoreCount = 1;
  present.pWaitSemaphores = &images_[index].painted;
  present.swapchainCount = 1;
  present.pSwapchains = &swapchain_;
  present.pImageIndices = &index;
  return gpu_.vk().QueuePresentKHR(gpu_.queue(), &present);
}

}  // namespace ballot
