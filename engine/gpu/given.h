// A Vulkan device that a program has made, and that Ballot works on.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace ballot {

/// A program's device and queue, as Vulkan's handles. All stay the program's, and must outlive the Context.
struct GivenVulkan {
  void *instance = nullptr, *physical_device = nullptr, *device = nullptr, *queue = nullptr;
  std::uint32_t queue_family = 0;
  std::uint32_t api_version = 0;          // of the program's VkApplicationInfo; 0: 1.2
  void* find = nullptr;                   // vkGetInstanceProcAddr; null: that of the system's loader
  std::vector<std::string> enabled = {};  // features and extensions, by the names of vulkan_needs(); none: the required
  /// Hold and release the queue, whose user is given to them; null: nobody else uses it during calls.
  void (*lock)(void* user) = nullptr;
  void (*unlock)(void* user) = nullptr;
  void* user = nullptr;
};

/// A feature or an extension that Ballot needs, or uses where it is enabled.
struct VulkanNeed {
  const char* name;  // "scalarBlockLayout", "VK_KHR_external_memory_fd"
  const char* of;    // what has the feature: a struct of Vulkan's, or an extension; "" for an extension
  bool required;
  const char* why;  // it is required; or what it costs to go without it
};

/// Returns all that Ballot needs or uses beyond Vulkan 1.2.
std::span<const VulkanNeed> vulkan_needs();

}  // namespace ballot
