// Reading a physical device's properties, and the table of what Ballot requires of it. Internal to engine/vk.
#pragma once

#include <vector>

#include "engine/vk/context.h"

namespace ballot {

/// Instance without layers unless asked; owned by the caller.
struct PhysicalDevice {
  VkPhysicalDevice handle;
  DeviceInfo info;
};
std::vector<PhysicalDevice> physical_devices(const Vulkan& vk, VkInstance instance);

/// What the driver says of a device, and can be made up in tests.
struct DeviceProperties {
  VkPhysicalDeviceProperties2 core{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, nullptr, {}};
  VkPhysicalDeviceVulkan11Properties v11{};
  VkPhysicalDeviceVulkan12Properties v12{};
  VkPhysicalDeviceSubgroupSizeControlPropertiesEXT size_control{};
};

struct DeviceFeatures {
  VkPhysicalDeviceFeatures2 core{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, nullptr, {}};
  VkPhysicalDeviceVulkan12Features v12{};
  VkPhysicalDeviceSubgroupSizeControlFeaturesEXT size_control{};
  VkPhysicalDeviceShaderSubgroupUniformControlFlowFeaturesKHR uniform_flow{};
  VkPhysicalDevicePipelineExecutablePropertiesFeaturesKHR executables{};
};

/// Why Ballot cannot use such a device: every requirement that it does not meet, with the reason for it.
std::vector<std::string> refusals_of(const DeviceProperties& properties, const DeviceFeatures& features);

/// The first queue family with compute; -1 if none.
int compute_family(const Vulkan& vk, VkPhysicalDevice device);

/// The first queue family that computes, draws and presents to this surface; -1 if none, or without VK_KHR_swapchain.
int present_family(const Vulkan& vk, VkPhysicalDevice device, VkSurfaceKHR surface);

/// Extensions beyond 1.2 core that Ballot enables where present.
std::vector<const char*> optional_extensions(const Vulkan& vk, VkPhysicalDevice device);

}  // namespace ballot
