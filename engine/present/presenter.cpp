#include "engine/present/presenter.h"

#include <algorithm>

#include "engine/core/error.h"

namespace ballot {

namespace {

/// A use of an image by a command: the layout, the stage and the access.
struct Use {
  VkImageLayout layout;
  VkPipelineStageFlags stage;
  VkAccessFlags access;
};

constexpr Use kUnused{VK_IMAGE_LAYOUT_UNDEFINED, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, 0};
constexpr Use kFilled{VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, VK_PIPELINE_STAGE_TRANSFER_BIT,
                      VK_ACCESS_TRANSFER_WRITE_BIT};
constexpr Use kCopied{VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, VK_PIPELINE_STAGE_TRANSFER_BIT,
                      VK_ACCESS_TRANSFER_READ_BIT};
constexpr Use kPainted{VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL, VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT,
                       VK_ACCESS_COLOR_ATTACHMENT_READ_BIT | VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT};
constexpr VkImageSubresourceRange kAll{VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
constexpr VkImageSubresourceLayers kColor{VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};

/// Records a barrier between two uses of an image, with the change of its layout.
void change_use(const Vulkan& vk, VkCommandBuffer cmd, VkImage image, const Use& from, const Use& to) {
  VkImageMemoryBarrier barrier{};
  barrier.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER;
  barrier.srcAccessMask = from.access;
  barrier.dstAccessMask = to.access;
  barrier.oldLayout = from.layout;
  barrier.newLayout = to.layout;
  barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  barrier.image = image;
  barrier.subresourceRange = kAll;
  vk.CmdPipelineBarrier(cmd, from.stage, to.stage, 0, 0, nullptr, 0, nullptr, 1, &barrier);
}

/// Returns all that a function of Vulkan lists. `what` names the work in errors.
template <class T, class List>
std::vector<T> listed(const char* what, const List& list) {
  std::uint32_t count = 0;
  vk_check(list(&count, static_cast<T*>(nullptr)), what);
  std::vector<T> all(count);
  vk_check(list(&count, all.data()), what);
  all.resize(count);
  return all;
}

// The pixels are sRGB encoded already: a UNORM format stores them as they are, an SRGB format would encode them again.
constexpr VkSurfaceFormatKHR kFormat{VK_FORMAT_B8G8R8A8_UNORM, VK_COLOR_SPACE_SRGB_NONLINEAR_KHR};

void expect_format(Context& gpu) {
  const auto formats = listed<VkSurfaceFormatKHR>("asking for the window's formats", [&](auto* count, auto* all) {
    return gpu.vk().GetPhysicalDeviceSurfaceFormatsKHR(gpu.physical(), gpu.surface(), count, all);
  });
  for (const VkSurfaceFormatKHR& f : formats)
    if (f.format == kFormat.format && f.colorSpace == kFormat.colorSpace) return;
  fail(Failure::Device, "{} does not offer this window the format BGRA with 8 bits; use another --device",
       gpu.info().name);
}

}  // namespace

Presenter::Presenter(Context& gpu) : gpu_(gpu) {
  expect_format(gpu);
  try {
    create_pass();
    VkFenceCreateInfo fence{};
    fence.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
    vk_check(gpu_.vk().CreateFence(gpu_.device(), &fence, nullptr, &acquired_), "creating a fence");
  } catch (...) {
    destroy();
    throw;
  }
}

Presenter::~Presenter() { destroy(); }

void Presenter::destroy() {
  gpu_.vk().DeviceWaitIdle(gpu_.device());
  destroy_small();
  destroy_images();
  gpu_.vk().DestroySwapchainKHR(gpu_.device(), swapchain_, nullptr);
  gpu_.vk().DestroyFence(gpu_.device(), acquired_, nullptr);
  gpu_.vk().DestroyRenderPass(gpu_.device(), pass_, nullptr);
}

void Presenter::destroy_images() {
  for (const Image& i : images_) {
    gpu_.vk().DestroyFramebuffer(gpu_.device(), i.framebuffer, nullptr);
    gpu_.vk().DestroyImageView(gpu_.device(), i.view, nullptr);
  }
  images_.clear();
}

void Presenter::destroy_small() {
  gpu_.vk().DestroyImage(gpu_.device(), std::exchange(small_, VK_NULL_HANDLE), nullptr);
  gpu_.vk().FreeMemory(gpu_.device(), std::exchange(small_memory_, VK_NULL_HANDLE), nullptr);
}

void Presenter::create_pass() {
  VkAttachmentDescription window{};
  window.format = kFormat.format;
  window.samples = VK_SAMPLE_COUNT_1_BIT;
  window.loadOp = VK_ATTACHMENT_LOAD_OP_LOAD;
  window.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
  window.stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE;
  window.stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE;
  window.initialLayout = kPainted.layout;
  window.finalLayout = VK_IMAGE_LAYOUT_PRESENT_SRC_KHR;
  const VkAttachmentReference color{0, kPainted.layout};
  VkSubpassDescription subpass{};
  subpass.pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS;
  subpass.colorAttachmentCount = 1;
  subpass.pColorAttachments = &color;
  VkRenderPassCreateInfo create{};
  create.sType = VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO;
  create.attachmentCount = 1;
  create.pAttachments = &window;
  create.subpassCount = 1;
  create.pSubpasses = &subpass;
  vk_check(gpu_.vk().CreateRenderPass(gpu_.device(), &create, nullptr, &pass_), "creating the window's render pass");
}

/// Creates the images for a window of this many pixels. There are none if the window has no area.
void Presenter::create_swapchain(VkExtent2D window) {
  VkSurfaceCapabilitiesKHR can{};
  vk_check(gpu_.vk().GetPhysicalDeviceSurfaceCapabilitiesKHR(gpu_.physical(), gpu_.surface(), &can),
           "asking what the window can do");
  extent_ = can.currentExtent;
  if (extent_.width == 0xFFFFFFFF) {  // the window takes the size of the swapchain
    extent_.width = std::clamp(window.width, can.minImageExtent.width, can.maxImageExtent.width);
    extent_.height = std::clamp(window.height, can.minImageExtent.height, can.maxImageExtent.height);
  }
  gpu_.wait_idle("waiting for the window's images");
  destroy_images();
  const VkSwapchainKHR old = std::exchange(swapchain_, VK_NULL_HANDLE);
  VkResult result = VK_SUCCESS;
  if (extent_.width && extent_.height) {
    VkSwapchainCreateInfoKHR create{};
    create.sType = VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR;
    create.surface = gpu_.surface();
    create.minImageCount = can.minImageCount + 1;
    if (can.maxImageCount) create.minImageCount = std::min(create.minImageCount, can.maxImageCount);
    create.imageFormat = kFormat.format;
    create.imageColorSpace = kFormat.colorSpace;
    create.imageExtent = extent_;
    create.imageArrayLayers = 1;
    create.imageUsage = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;
    create.preTransform = can.currentTransform;
    create.compositeAlpha = VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR;
    create.presentMode = VK_PRESENT_MODE_FIFO_KHR;  // each picture waits for a refresh of the screen: none tears
    create.clipped = VK_TRUE;
    create.oldSwapchain = old;
    result = gpu_.vk().CreateSwapchainKHR(gpu_.device(), &create, nullptr, &swapchain_);
  }
  gpu_.vk().DestroySwapchainKHR(gpu_.device(), old, nullptr);
  vk_check(result, "creating the window's images");
  if (swapchain_) create_images();
}

void Presenter::create_images() {
  const auto handles = listed<VkImage>("asking for the window's images", [&](auto* count, auto* all) {
    return gpu_.vk().GetSwapchainImagesKHR(gpu_.device(), swapchain_, count, all);
  });
  for (const VkImage handle : handles) {
    Image& i = images_.emplace_back();
    i.image = handle;
    VkImageViewCreateInfo view{};
    view.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO;
    view.image = handle;
    view.viewType = VK_IMAGE_VIEW_TYPE_2D;
    view.format = kFormat.format;
    view.subresourceRange = kAll;
    vk_check(gpu_.vk().CreateImageView(gpu_.device(), &view, nullptr, &i.view), "creating a view of the window");
    VkFramebufferCreateInfo framebuffer{};
    framebuffer.sType = VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO;
    framebuffer.renderPass = pass_;
    framebuffer.attachmentCount = 1;
    framebuffer.pAttachments = &i.view;
    framebuffer.width = extent_.width;
    framebuffer.height = extent_.height;
    framebuffer.layers = 1;
    vk_check(gpu_.vk().CreateFramebuffer(gpu_.device(), &framebuffer, nullptr, &i.framebuffer),
             "creating a framebuffer");
  }
}

/// Waits for the next image of the window, and writes its index. Returns false if there is none.
bool Presenter::acquire(VkExtent2D window, std::uint32_t& index) {
  for (int attempt = 0; attempt < 2; ++attempt) {
    if (stale_ || extent_.width != window.width || extent_.height != window.height) {
      stale_ = true;
      create_swapchain(window);
      if (!swapchain_) return false;
    }
    const VkResult result =
        gpu_.vk().AcquireNextImageKHR(gpu_.device(), swapchain_, UINT64_MAX, VK_NULL_HANDLE, acquired_, &index);
    stale_ = result == VK_ERROR_OUT_OF_DATE_KHR || result == VK_SUBOPTIMAL_KHR;
    if (result == VK_ERROR_OUT_OF_DATE_KHR) continue;
    if (!stale_) gpu_.check(result, "asking for the window's next image");  // an image that is suboptimal is shown
    gpu_.check(gpu_.wait_for(acquired_), "waiting for the window's next image");
    vk_check(gpu_.vk().ResetFences(gpu_.device(), 1, &acquired_), "resetting the fence of the window");
    return true;
  }
  return false;
}

/// Makes the image that is scaled to the window.
void Presenter::make_small(const ShownPicture& picture) {
  if (small_ && small_size_.width >= picture.width && small_size_.height >= picture.height) return;
  destroy_small();
  small_size_ = {std::max(small_size_.width, picture.width), std::max(small_size_.height, picture.height)};
  VkImageCreateInfo create{};
  create.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO;
  create.imageType = VK_IMAGE_TYPE_2D;
  create.format = kFormat.format;
  create.extent = {small_size_.width, small_size_.height, 1};
  create.mipLevels = create.arrayLayers = 1;
  create.samples = VK_SAMPLE_COUNT_1_BIT;
  create.usage = VK_IMAGE_USAGE_TRANSFER_DST_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT;
  vk_check(gpu_.vk().CreateImage(gpu_.device(), &create, nullptr, &small_), "creating the picture to scale");
  VkMemoryRequirements needs;
  gpu_.vk().GetImageMemoryRequirements(gpu_.device(), small_, &needs);
  VkMemoryAllocateInfo allocate{};
  allocate.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
  allocate.allocationSize = needs.size;
  allocate.memoryTypeIndex = gpu_.memory_type(needs.memoryTypeBits, 0, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
  vk_check(gpu_.vk().AllocateMemory(gpu_.device(), &allocate, nullptr, &small_memory_),
           "allocating the picture to scale");
  vk_check(gpu_.vk().BindImageMemory(gpu_.device(), small_, small_memory_, 0), "binding the picture to scale");
  gpu_.name(VK_OBJECT_TYPE_IMAGE, std::uint64_t(small_), "picture to scale");
}

bool Presenter::show(const ShownPicture& picture, const Paint& paint, std::uint32_t window_width,
                     std::uint32_t window_height) {
  std::uint32_t index = 0;
  if (window_width == 0 || window_height == 0 || !acquire({window_width, window_height}, index)) return false;
  if (picture.pixels && !fits(picture)) make_small(picture);
  const PassScope scope(gpu_);
  gpu_.submit("a frame of the window", [&](Commands& cmd) { record(cmd.handle(), images_[index], picture, paint); });
  last_ms_ = gpu_.last_ms();
  VkPresentInfoKHR present{};
  present.sType = VK_STRUCTURE_TYPE_PRESENT_INFO_KHR;
  present.swapchainCount = 1;
  present.pSwapchains = &swapchain_;
  present.pImageIndices = &index;
  const VkResult result = gpu_.vk().QueuePresentKHR(gpu_.queue(), &present);
  const bool outdated = result == VK_ERROR_OUT_OF_DATE_KHR || result == VK_SUBOPTIMAL_KHR;
  if (!outdated) gpu_.check(result, "presenting to the window");
  stale_ |= outdated;
  return true;
}

void Presenter::record(VkCommandBuffer cmd, const Image& image, const ShownPicture& picture, const Paint& paint) {
  change_use(gpu_.vk(), cmd, image.image, kUnused, kFilled);
  record_picture(cmd, image.image, picture);
  change_use(gpu_.vk(), cmd, image.image, kFilled, kPainted);
  VkRenderPassBeginInfo pass{};
  pass.sType = VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO;
  pass.renderPass = pass_;
  pass.framebuffer = image.framebuffer;
  pass.renderArea.extent = extent_;
  gpu_.vk().CmdBeginRenderPass(cmd, &pass, VK_SUBPASS_CONTENTS_INLINE);
  paint(cmd);
  gpu_.vk().CmdEndRenderPass(cmd);
}

void Presenter::record_picture(VkCommandBuffer cmd, VkImage to, const ShownPicture& picture) {
  if (!picture.pixels) {
    const VkClearColorValue black{{0, 0, 0, 1}};
    gpu_.vk().CmdClearColorImage(cmd, to, kFilled.layout, &black, 1, &kAll);
    return;
  }
  const VkBufferImageCopy copy{0, 0, 0, kColor, {0, 0, 0}, {picture.width, picture.height, 1}};
  if (!fits(picture)) change_use(gpu_.vk(), cmd, small_, kUnused, kFilled);
  gpu_.vk().CmdCopyBufferToImage(cmd, picture.pixels->handle(), fits(picture) ? to : small_, kFilled.layout, 1, &copy);
  if (fits(picture)) return;
  change_use(gpu_.vk(), cmd, small_, kFilled, kCopied);
  VkImageBlit blit{};
  blit.srcSubresource = blit.dstSubresource = kColor;
  blit.srcOffsets[1] = {std::int32_t(picture.width), std::int32_t(picture.height), 1};
  blit.dstOffsets[1] = {std::int32_t(extent_.width), std::int32_t(extent_.height), 1};
  gpu_.vk().CmdBlitImage(cmd, small_, kCopied.layout, to, kFilled.layout, 1, &blit, VK_FILTER_LINEAR);
}

}  // namespace ballot
