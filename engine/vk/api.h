// The Vulkan functions that Ballot calls, found at run time: a machine without a Vulkan loader gets an Error, not a
// message of the dynamic linker.
#pragma once

#define VK_NO_PROTOTYPES
#include <vulkan/vulkan.h>

// clang-format off
#define BALLOT_VK_GLOBAL(X) \
  X(vkCreateInstance) X(vkEnumerateInstanceExtensionProperties) X(vkEnumerateInstanceLayerProperties) \
  X(vkEnumerateInstanceVersion)
#define BALLOT_VK_INSTANCE(X) \
  X(vkDestroyInstance) X(vkEnumeratePhysicalDevices) X(vkGetPhysicalDeviceProperties2) X(vkGetPhysicalDeviceFeatures2) \
  X(vkGetPhysicalDeviceMemoryProperties) X(vkGetPhysicalDeviceQueueFamilyProperties) \
  X(vkEnumerateDeviceExtensionProperties) X(vkCreateDevice) X(vkDestroyDevice) X(vkGetDeviceQueue) \
  X(vkAllocateMemory) X(vkFreeMemory) X(vkMapMemory) X(vkUnmapMemory) X(vkCreateBuffer) X(vkDestroyBuffer) \
  X(vkGetBufferMemoryRequirements) X(vkBindBufferMemory) X(vkCreateBufferView) X(vkDestroyBufferView) \
  X(vkGetBufferDeviceAddress) X(vkCreateShaderModule) X(vkDestroyShaderModule) X(vkCreatePipelineCache) \
  X(vkDestroyPipelineCache) X(vkGetPipelineCacheData) X(vkCreateComputePipelines) X(vkDestroyPipeline) \
  X(vkCreatePipelineLayout) X(vkDestroyPipelineLayout) X(vkCreateDescriptorSetLayout) \
  X(vkDestroyDescriptorSetLayout) X(vkCreateDescriptorPool) X(vkDestroyDescriptorPool) X(vkAllocateDescriptorSets) \
  X(vkUpdateDescriptorSets) X(vkCreateCommandPool) X(vkDestroyCommandPool) X(vkAllocateCommandBuffers) \
  X(vkResetCommandPool) X(vkBeginCommandBuffer) X(vkEndCommandBuffer) X(vkQueueSubmit) X(vkQueueWaitIdle) \
  X(vkCreateFence) X(vkDestroyFence) X(vkWaitForFences) X(vkResetFences) X(vkCreateQueryPool) X(vkDestroyQueryPool) \
  X(vkGetQueryPoolResults) X(vkCmdResetQueryPool) X(vkCmdWriteTimestamp) X(vkCmdBindPipeline) \
  X(vkCmdBindDescriptorSets) X(vkCmdPushConstants) X(vkCmdDispatch) X(vkCmdDispatchIndirect) X(vkCmdCopyBuffer) X(vkCmdFillBuffer) \
  X(vkCmdUpdateBuffer) X(vkCmdPipelineBarrier) X(vkDeviceWaitIdle)
// What only a window needs: images, a render pass, semaphores.
#define BALLOT_VK_DRAWING(X) \
  X(vkGetPhysicalDeviceFormatProperties) X(vkCreateImage) X(vkDestroyImage) X(vkGetImageMemoryRequirements) \
  X(vkBindImageMemory) X(vkCreateImageView) X(vkDestroyImageView) X(vkCreateSampler) X(vkDestroySampler) \
  X(vkCreateRenderPass) X(vkDestroyRenderPass) X(vkCreateFramebuffer) X(vkDestroyFramebuffer) \
  X(vkCreateGraphicsPipelines) X(vkCmdBeginRenderPass) X(vkCmdEndRenderPass) X(vkCmdSetViewport) X(vkCmdSetScissor) \
  X(vkCmdDraw) X(vkCmdCopyBufferToImage) X(vkCmdBlitImage) X(vkCmdClearColorImage) X(vkCreateSemaphore) \
  X(vkDestroySemaphore) X(vkResetCommandBuffer)
#define BALLOT_VK_SURFACE(X) \
  X(vkDestroySurfaceKHR) X(vkGetPhysicalDeviceSurfaceSupportKHR) X(vkGetPhysicalDeviceSurfaceCapabilitiesKHR) \
  X(vkGetPhysicalDeviceSurfaceFormatsKHR) X(vkGetPhysicalDeviceSurfacePresentModesKHR) X(vkCreateSwapchainKHR) \
  X(vkDestroySwapchainKHR) X(vkGetSwapchainImagesKHR) X(vkAcquireNextImageKHR) X(vkQueuePresentKHR)
#define BALLOT_VK_DEBUG(X) \
  X(vkCreateDebugUtilsMessengerEXT) X(vkDestroyDebugUtilsMessengerEXT) X(vkSetDebugUtilsObjectNameEXT) \
  X(vkCmdBeginDebugUtilsLabelEXT) X(vkCmdEndDebugUtilsLabelEXT)
#define BALLOT_VK_STATISTICS(X) X(vkGetPipelineExecutableStatisticsKHR)
// clang-format on

namespace ballot {

#define BALLOT_VK_DECLARE(f) extern PFN_##f f;
BALLOT_VK_GLOBAL(BALLOT_VK_DECLARE)
BALLOT_VK_INSTANCE(BALLOT_VK_DECLARE)
BALLOT_VK_DRAWING(BALLOT_VK_DECLARE)
BALLOT_VK_SURFACE(BALLOT_VK_DECLARE)     // null unless the instance can make surfaces
BALLOT_VK_DEBUG(BALLOT_VK_DECLARE)       // null unless validation is on
BALLOT_VK_STATISTICS(BALLOT_VK_DECLARE)  // null unless some device tells
#undef BALLOT_VK_DECLARE

/// Opens the loader and finds the global functions, once. Throws Error(Device) if there is no loader.
void load_vulkan();
/// Finds the rest for this instance. One instance lives at a time.
void load_instance_functions(VkInstance instance, bool debug, bool surface);

/// "VK_ERROR_DEVICE_LOST" for its value.
const char* result_name(VkResult result);
/// Throws Error(Work) "WHAT: VK_..." unless result is VK_SUCCESS; `what` says what was tried on which object.
void vk_check(VkResult result, const char* what, const char* object = "");

}  // namespace ballot
