#include "engine/present/presenter.h"

#include <algorithm>
#include <chrono>

#include "engine/core/error.h"
#include "engine/present/images.h"

namespace ballot {

namespace {

constexpr Use kAcquired{VK_IMAGE_LAYOUT_UNDEFINED, VK_PIPELINE_STAGE_TRANSFER_BIT,
                        0};  // the submission waits there for Frame::ready
constexpr Use kFilled{VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, VK_PIPELINE_STAGE_TRANSFER_BIT,
                      VK_ACCESS_TRANSFER_WRITE_BIT};
constexpr Use kCopied{VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, VK_PIPELINE_STAGE_TRANSFER_BIT,
                      VK_ACCESS_TRANSFER_READ_BIT};
constexpr Use kPainted{VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL, VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT,
                       VK_ACCESS_COLOR_ATTACHMENT_READ_BIT | VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT};
constexpr VkImageSubresourceLayers kColor{VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};

bool filters_linearly(Context& gpu, VkFormat format) {
  VkFormatProperties properties{};
  gpu.vk().GetPhysicalDeviceFormatProperties(gpu.physical(), format, &properties);
  return (properties.optimalTilingFeatures & VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT) != 0;
}

}  // namespace

Presenter::Presenter(Context& gpu, Pace pace)
    : gpu_(gpu), swapchain_(gpu, pace), linear_(filters_linearly(gpu, swapchain_.format())) {
  try {
    create_pass();
    create_frames();
    painter_ = std::make_unique<Painter>(gpu_, pass_, kFrames);
  } catch (...) {
    destroy();
    throw;
  }
}

Presenter::~Presenter() { destroy(); }

void Presenter::destroy() {
  gpu_.vk().DeviceWaitIdle(gpu_.device());
  painter_.reset();
  gpu_.vk().DestroyImage(gpu_.device(), small_, nullptr);
  gpu_.vk().FreeMemory(gpu_.device(), small_memory_, nullptr);
  for (const Frame& f : frames_) {
    gpu_.vk().DestroySemaphore(gpu_.device(), f.ready, nullptr);
    gpu_.vk().DestroyFence(gpu_.device(), f.done, nullptr);
  }
  gpu_.vk().DestroyQueryPool(gpu_.device(), queries_, nullptr);
  gpu_.vk().DestroyCommandPool(gpu_.device(), commands_, nullptr);
  gpu_.vk().DestroyRenderPass(gpu_.device(), pass_, nullptr);
}

void Presenter::create_pass() {
  VkAttachmentDescription window{};
  window.format = swapchain_.format();
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

void Presenter::create_frames() {
  VkCommandPoolCreateInfo pool{};
  pool.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
  pool.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
  pool.queueFamilyIndex = gpu_.queue_family();
  vk_check(gpu_.vk().CreateCommandPool(gpu_.device(), &pool, nullptr, &commands_),
           "creating the window's command pool");
  if (gpu_.info().timestamp_ns > 0) {
    VkQueryPoolCreateInfo queries{};
    queries.sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO;
    queries.queryType = VK_QUERY_TYPE_TIMESTAMP;
    queries.queryCount = 2 * kFrames;
    vk_check(gpu_.vk().CreateQueryPool(gpu_.device(), &queries, nullptr, &queries_),
             "creating the window's query pool");
  }
  for (Frame& f : frames_) {
    VkCommandBufferAllocateInfo allocate{};
    allocate.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
    allocate.commandPool = commands_;
    allocate.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
    allocate.commandBufferCount = 1;
    vk_check(gpu_.vk().AllocateCommandBuffers(gpu_.device(), &allocate, &f.commands),
             "allocating the window's commands");
    VkSemaphoreCreateInfo semaphore{};
    semaphore.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO;
    vk_check(gpu_.vk().CreateSemaphore(gpu_.device(), &semaphore, nullptr, &f.ready), "creating a semaphore");
    VkFenceCreateInfo fence{};
    fence.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
    fence.flags = VK_FENCE_CREATE_SIGNALED_BIT;
    vk_check(gpu_.vk().CreateFence(gpu_.device(), &fence, nullptr, &f.done), "creating a fence");
  }
}

void Presenter::set_atlas(const PaintAtlas& atlas) {
  gpu_.check(gpu_.vk().DeviceWaitIdle(gpu_.device()), "waiting for the window");
  painter_->set_atlas(atlas);
}

bool Presenter::follow(VkExtent2D window) {
  const VkExtent2D now = swapchain_.extent();
  if (!stale_ && swapchain_.exists() && now.width == window.width && now.height == window.height) return true;
  stale_ = !swapchain_.create(pass_, window);
  return !stale_;
}

bool Presenter::acquire(Frame& frame, VkExtent2D window, std::uint32_t& index) {
  for (int attempt = 0; attempt < 2; ++attempt) {
    if (!follow(window)) return false;
    const VkResult result = swapchain_.acquire(frame.ready, index);
    if (result == VK_SUBOPTIMAL_KHR) stale_ = true;  // this image is still shown
    if (result == VK_SUCCESS || result == VK_SUBOPTIMAL_KHR) return true;
    if (result != VK_ERROR_OUT_OF_DATE_KHR) gpu_.check(result, "asking for the window's next image");
    stale_ = true;
  }
  return false;
}

void Presenter::read_time(std::uint32_t frame) {
  if (!queries_ || !frames_[frame].timed) return;
  std::uint64_t ticks[2] = {};
  if (gpu_.vk().GetQueryPoolResults(gpu_.device(), queries_, frame * 2, 2, sizeof ticks, ticks, sizeof ticks[0],
                                    VK_QUERY_RESULT_64_BIT) == VK_SUCCESS)
    last_ms_ = double(ticks[1] - ticks[0]) * gpu_.info().timestamp_ns * 1e-6;
}

void Presenter::make_stretched(const ShownPicture& picture) {
  if (small_ && small_size_.width >= picture.width && small_size_.height >= picture.height) return;
  gpu_.check(gpu_.vk().DeviceWaitIdle(gpu_.device()), "waiting for the window");
  gpu_.vk().DestroyImage(gpu_.device(), small_, nullptr);
  gpu_.vk().FreeMemory(gpu_.device(), small_memory_, nullptr);
  small_ = VK_NULL_HANDLE;
  small_memory_ = VK_NULL_HANDLE;
  small_size_ = {std::max(small_size_.width, picture.width), std::max(small_size_.height, picture.height)};
  small_ = create_image(gpu_, small_size_, swapchain_.format(),
                        VK_IMAGE_USAGE_TRANSFER_DST_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT, "picture to stretch",
                        small_memory_);
}

bool Presenter::show(const ShownPicture& picture, const PaintList& list, std::uint32_t window_width,
                     std::uint32_t window_height) {
  if (window_width == 0 || window_height == 0) return false;
  Frame& frame = frames_[next_];
  gpu_.check(gpu_.wait_for(frame.done), "waiting for a frame");
  read_time(next_);
  std::uint32_t index = 0;
  painter_->upload(next_, list);
  if (!acquire(frame, {window_width, window_height}, index)) return false;
  if (picture.pixels) make_stretched(picture);
  record(next_, swapchain_[index], picture, list);
  vk_check(gpu_.vk().ResetFences(gpu_.device(), 1, &frame.done), "resetting a frame's fence");
  const VkPipelineStageFlags wait = VK_PIPELINE_STAGE_TRANSFER_BIT;
  VkSubmitInfo submit{};
  submit.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
  submit.waitSemaphoreCount = 1;
  submit.pWaitSemaphores = &frame.ready;
  submit.pWaitDstStageMask = &wait;
  submit.commandBufferCount = 1;
  submit.pCommandBuffers = &frame.commands;
  submit.signalSemaphoreCount = 1;
  submit.pSignalSemaphores = &swapchain_[index].painted;
  const auto start = std::chrono::steady_clock::now();
  gpu_.check(gpu_.vk().QueueSubmit(gpu_.queue(), 1, &submit, frame.done), "submitting a frame of the window");
  if (!queries_) {  // so that the wall time of the next submission does not include this one
    gpu_.check(gpu_.wait_for(frame.done), "waiting for a frame");
    last_ms_ = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  }
  frame.timed = true;
  next_ = (next_ + 1) % kFrames;
  const VkResult result = swapchain_.present(index);
  if (result == VK_ERROR_OUT_OF_DATE_KHR || result == VK_SUBOPTIMAL_KHR)
    stale_ = true;
  else
    gpu_.check(result, "presenting to the window");
  return true;
}

void Presenter::record(std::uint32_t frame, const Swapchain::Image& image, const ShownPicture& picture,
                       const PaintList& list) {
  const VkCommandBuffer cmd = frames_[frame].commands;
  vk_check(gpu_.vk().ResetCommandBuffer(cmd, 0), "resetting a frame's commands");
  VkCommandBufferBeginInfo begin{};
  begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
  begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  vk_check(gpu_.vk().BeginCommandBuffer(cmd, &begin), "recording a frame of the window");
  if (queries_) {
    gpu_.vk().CmdResetQueryPool(cmd, queries_, frame * 2, 2);
    gpu_.vk().CmdWriteTimestamp(cmd, VK_PIPELINE_STAGE_TRANSFER_BIT, queries_, frame * 2);
  }
  change_use(gpu_.vk(), cmd, image.image, kAcquired, kFilled);
  record_picture(cmd, image.image, picture);
  change_use(gpu_.vk(), cmd, image.image, kFilled, kPainted);
  VkRenderPassBeginInfo pass{};
  pass.sType = VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO;
  pass.renderPass = pass_;
  pass.framebuffer = image.framebuffer;
  pass.renderArea.extent = swapchain_.extent();
  gpu_.vk().CmdBeginRenderPass(cmd, &pass, VK_SUBPASS_CONTENTS_INLINE);
  painter_->record(cmd, frame, list, swapchain_.extent());
  gpu_.vk().CmdEndRenderPass(cmd);
  // The next submission may overwrite the pixels, the vertices and the unscaled picture.
  VkMemoryBarrier barrier{};
  barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
  barrier.srcAccessMask = VK_ACCESS_MEMORY_WRITE_BIT;
  barrier.dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
  gpu_.vk().CmdPipelineBarrier(cmd, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, 0, 1,
                               &barrier, 0, nullptr, 0, nullptr);
  if (queries_) gpu_.vk().CmdWriteTimestamp(cmd, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, queries_, frame * 2 + 1);
  vk_check(gpu_.vk().EndCommandBuffer(cmd), "recording a frame of the window");
}

void Presenter::record_picture(VkCommandBuffer cmd, VkImage to, const ShownPicture& picture) {
  const VkExtent2D window = swapchain_.extent();
  if (!picture.pixels) {
    const VkClearColorValue black{{0, 0, 0, 1}};
    const VkImageSubresourceRange all{VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    gpu_.vk().CmdClearColorImage(cmd, to, kFilled.layout, &black, 1, &all);
    return;
  }
  const bool direct = picture.width == window.width && picture.height == window.height;
  const VkBufferImageCopy copy{0, 0, 0, kColor, {0, 0, 0}, {picture.width, picture.height, 1}};
  if (!direct) change_use(gpu_.vk(), cmd, small_, kAcquired, kFilled);
  gpu_.vk().CmdCopyBufferToImage(cmd, picture.pixels->handle(), direct ? to : small_, kFilled.layout, 1, &copy);
  if (direct) return;
  change_use(gpu_.vk(), cmd, small_, kFilled, kCopied);
  VkImageBlit blit{};
  blit.srcSubresource = blit.dstSubresource = kColor;
  blit.srcOffsets[1] = {std::int32_t(picture.width), std::int32_t(picture.height), 1};
  blit.dstOffsets[1] = {std::int32_t(window.width), std::int32_t(window.height), 1};
  gpu_.vk().CmdBlitImage(cmd, small_, kCopied.layout, to, kFilled.layout, 1, &blit,
                         linear_ ? VK_FILTER_LINEAR : VK_FILTER_NEAREST);
}

}  // namespace ballot
