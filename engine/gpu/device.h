// Reads the properties of physical devices and checks them against Ballot's requirements. Internal to engine/gpu.
#pragma once

#include <vector>

#include "engine/gpu/context.h"

namespace ballot {

/// A physical device and its properties.
struct PhysicalDevice {
  VkPhysicalDevice handle;
  DeviceInfo info;
};
std::vector<PhysicalDevice> physical_devices(const Vulkan& vk, VkInstance instance);

/// The properties of a device as the driver reports them. Tests can make them up.
struct DeviceProperties {
  VkPhysicalDeviceProperties2 core{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, nullptr, {}};
  VkPhysicalDeviceVulkan11Properties v11{};
  VkPhysicalDeviceVulkan12Properties v12{};
  VkPhysicalDeviceSubgroupSizeControlPropertiesEXT size_control{};
  VkPhysicalDeviceExternalMemoryHostPropertiesEXT host{};
  VkPhysicalDeviceMaintenance4PropertiesKHR buffers{};
};

/// The features of a device as the driver reports them.
struct DeviceFeatures {
  VkPhysicalDeviceFeatures2 core{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, nullptr, {}};
  VkPhysicalDeviceVulkan12Features v12{};
  VkPhysicalDeviceSubgroupSizeControlFeaturesEXT size_control{};
  VkPhysicalDeviceShaderSubgroupUniformControlFlowFeaturesKHR uniform_flow{};
  VkPhysicalDevicePipelineExecutablePropertiesFeaturesKHR executables{};
};

/// Returns why Ballot cannot use such a device: every requirement that it does not meet, with the reason for it.
std::vector<std::string> refusals_of(const DeviceProperties& properties, const DeviceFeatures& features);

/// Notes what depends on the family of the queue that a device is used by: timestamps. Throws Error(Device) if there is
/// no such family, or it is without compute.
void take_queue(const Vulkan& vk, VkPhysicalDevice device, std::uint32_t family, DeviceInfo& info);

/// Returns the optional features that a device lacks, and what that costs.
std::vector<std::string> lacks_of(const DeviceInfo& device);

/// Has a device go without what a program has not enabled (vulkan_needs()); no names: what is required is. Throws
/// Error(Arguments) for a name that is none, or that the device does not have, Error(Device) if what is required is not
/// among them.
void take_what_is_off(const std::vector<std::string>& enabled, DeviceInfo& device);

/// Throws Error(Device): the loader found no driver, which files the environment names, and what installs one.
[[noreturn]] void fail_without_driver();

/// Returns the first queue family with compute, or -1 if there is none.
int compute_family(const Vulkan& vk, VkPhysicalDevice device);

/// Returns the first queue family that has compute and graphics and presents to this surface. Returns -1 if there is
/// none or the device has no VK_KHR_swapchain.
int present_family(const Vulkan& vk, VkPhysicalDevice device, VkSurfaceKHR surface);

/// Returns the extensions beyond Vulkan 1.2 that Ballot enables where the device has them.
std::vector<const char*> optional_extensions(const Vulkan& vk, VkPhysicalDevice device);

}  // namespace ballot
