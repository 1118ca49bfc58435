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
std::vector<PhysicalDevice> physical_devices(VkInstance instance);

/// The first queue family with compute; -1 if none.
int compute_family(VkPhysicalDevice device);

/// Extensions beyond 1.2 core that Ballot enables where present.
std::vector<const char*> optional_extensions(VkPhysicalDevice device);

}  // namespace ballot
