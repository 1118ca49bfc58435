// The Vulkan functions that Ballot calls, found at run time. So a machine without a Vulkan loader gets an Error instead
// of a message of the dynamic linker. Each Context has its own table of functions; devices share no state.
#pragma once

#define VK_NO_PROTOTYPES
#include <vulkan/vulkan.h>

#include "engine/core/error.h"

// clang-format off
#define BALLOT_VK_LOADER(X) \
  X(CreateInstance) X(EnumerateInstanceExtensionProperties) X(EnumerateInstanceLayerProperties) \
  X(EnumerateInstanceVersion)
#define BALLOT_VK_INSTANCE(X) \
  X(DestroyInstance) X(EnumeratePhysicalDevices) X(GetPhysicalDeviceProperties2) \
  X(GetPhysicalDeviceFeatures2) X(GetPhysicalDeviceMemoryProperties) \
  X(GetPhysicalDeviceQueueFamilyProperties) X(EnumerateDeviceExtensionProperties) X(CreateDevice) \
  X(GetDeviceProcAddr)
#define BALLOT_VK_DEVICE(X) \
  X(DestroyDevice) X(GetDeviceQueue) X(AllocateMemory) X(FreeMemory) X(MapMemory) X(UnmapMemory) \
  X(CreateBuffer) X(DestroyBuffer) X(GetBufferMemoryRequirements) X(BindBufferMemory) X(CreateBufferView) \
  X(DestroyBufferView) X(GetBufferDeviceAddress) X(CreateShaderModule) X(DestroyShaderModule) \
  X(CreatePipelineCache) X(DestroyPipelineCache) X(GetPipelineCacheData) X(CreateComputePipelines) \
  X(DestroyPipeline) X(CreatePipelineLayout) X(DestroyPipelineLayout) X(CreateDescriptorSetLayout) \
  X(DestroyDescriptorSetLayout) X(CreateDescriptorPool) X(DestroyDescriptorPool) X(AllocateDescriptorSets) \
  X(UpdateDescriptorSets) X(CreateCommandPool) X(DestroyCommandPool) X(AllocateCommandBuffers) \
  X(ResetCommandPool) X(BeginCommandBuffer) X(EndCommandBuffer) X(QueueSubmit) X(QueueWaitIdle) \
  X(CreateFence) X(DestroyFence) X(GetFenceStatus) \
  X(WaitForFences) X(ResetFences) X(CreateQueryPool) X(DestroyQueryPool) \
  X(GetQueryPoolResults) X(CmdResetQueryPool) X(CmdWriteTimestamp) X(CmdBindPipeline) \
  X(CmdBindDescriptorSets) X(CmdPushConstants) X(CmdDispatch) X(CmdDispatchIndirect) X(CmdCopyBuffer) \
  X(CmdFillBuffer) X(CmdUpdateBuffer) X(CmdPipelineBarrier) X(DeviceWaitIdle)
// Functions that only a window needs: images, a render pass.
#define BALLOT_VK_DRAWING(X) \
  X(CreateImage) X(DestroyImage) X(GetImageMemoryRequirements) X(BindImageMemory) X(CreateImageView) \
  X(DestroyImageView) X(CreateRenderPass) X(DestroyRenderPass) X(CreateFramebuffer) X(DestroyFramebuffer) \
  X(CmdBeginRenderPass) X(CmdEndRenderPass) X(CmdCopyBufferToImage) X(CmdBlitImage) X(CmdClearColorImage)
#define BALLOT_VK_SURFACE(X) \
  X(DestroySurfaceKHR) X(GetPhysicalDeviceSurfaceSupportKHR) X(GetPhysicalDeviceSurfaceCapabilitiesKHR) \
  X(GetPhysicalDeviceSurfaceFormatsKHR)
#define BALLOT_VK_SWAPCHAIN(X) \
  X(CreateSwapchainKHR) X(DestroySwapchainKHR) X(GetSwapchainImagesKHR) X(AcquireNextImageKHR) \
  X(QueuePresentKHR)
#define BALLOT_VK_DEBUG(X) \
  X(CreateDebugUtilsMessengerEXT) X(DestroyDebugUtilsMessengerEXT) X(SetDebugUtilsObjectNameEXT) \
  X(CmdBeginDebugUtilsLabelEXT) X(CmdEndDebugUtilsLabelEXT)
#define BALLOT_VK_STATISTICS(X) \
  X(GetPipelineExecutableStatisticsKHR)
#define BALLOT_VK_EXTERNAL(X) \
  X(GetMemoryFdKHR) X(GetMemoryHostPointerPropertiesEXT) X(GetDeviceFaultInfoEXT)
// clang-format on

namespace ballot {

/// What installs a driver and its loader, for the end of an error's text.
inline constexpr const char* kDriverInstall =
    "such as lavapipe, which runs on any CPU: Debian, Ubuntu: apt install mesa-vulkan-drivers libvulkan1; Fedora: dnf "
    "install mesa-vulkan-drivers vulkan-loader; Arch: pacman -S vulkan-swrast vulkan-icd-loader; Python: pip install "
    "\"ballot[cpu]\"; in a container: inside of it, or NVIDIA's by --gpus all -e NVIDIA_DRIVER_CAPABILITIES=all";

#define BALLOT_VK_MEMBER(f) PFN_vk##f f = nullptr;

/// The functions of the Vulkan loader itself.
struct VulkanLoader {
  PFN_vkGetInstanceProcAddr GetInstanceProcAddr = nullptr;
  BALLOT_VK_LOADER(BALLOT_VK_MEMBER)
};

/// Returns the loader, which the first call opens. Thread-safe. Throws Error(Device) if there is no usable loader.
const VulkanLoader& vulkan_loader();

/// The functions of one instance and, after load_device(), of one device.
struct Vulkan {
  BALLOT_VK_INSTANCE(BALLOT_VK_MEMBER)
  BALLOT_VK_SURFACE(BALLOT_VK_MEMBER)  // null unless the instance was made for a window
  BALLOT_VK_DEBUG(BALLOT_VK_MEMBER)    // null unless validation is on
  BALLOT_VK_DEVICE(BALLOT_VK_MEMBER)
  BALLOT_VK_DRAWING(BALLOT_VK_MEMBER)
  BALLOT_VK_SWAPCHAIN(BALLOT_VK_MEMBER)   // null unless the device can present
  BALLOT_VK_STATISTICS(BALLOT_VK_MEMBER)  // null unless the device was created with pipeline statistics
  BALLOT_VK_EXTERNAL(BALLOT_VK_MEMBER)    // null unless the device has the extension

  void load_instance(VkInstance instance, PFN_vkGetInstanceProcAddr find, bool debug, bool surface);
  void load_device(VkDevice device);
};

#undef BALLOT_VK_MEMBER

/// The device was lost (VK_ERROR_DEVICE_LOST): its driver gave it up, and what lay in its memory is gone.
class DeviceLost : public Error {
 public:
  explicit DeviceLost(const std::string& text) : Error(Failure::Work, text) {}
};

/// Returns the name of a result, e.g. "VK_ERROR_DEVICE_LOST".
const char* result_name(VkResult result);
/// Throws Error(Work) unless the result is VK_SUCCESS, and DeviceLost if the device is lost. The text is
/// "WHAT OBJECT: VK_...". `what` and `object` tell what was tried on which object.
void vk_check(VkResult result, const char* what, const char* object = "");

}  // namespace ballot
